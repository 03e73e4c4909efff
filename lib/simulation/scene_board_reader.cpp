// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rig/board_layout.h"
#include "rig/yaml_parts.h"
#include "simulation/board_print.h"
#include "simulation/scene_parts.h"

namespace vlp {

SceneBoard read_scene_board(YamlMap map) {
  SceneBoard board;
  const YamlValue print_value = map.required("pattern");
  YamlMap print = print_value.map();
  board.print = read_board(print);
  print.finish();
  board.margin_m = map.required("margin_m").number_within(0, 2, "m");
  const YamlValue warp = map.required("warp_m");
  board.warp_m = Eigen::Vector2d(warp.numbers(2).data());
  constexpr double micrometers = 1e6;  // unit of the bound in messages
  const double tenth_m =
      0.1 * compute_tag_pitch_m(board.print) * std::min(board.print.cols, board.print.rows);
  const double max_warp_m = std::round(micrometers * tenth_m) / micrometers;
  for (const YamlValue& part : warp.list()) part.number_within(-max_warp_m, max_warp_m, "m");
  board.white_e_per_s = read_radiance(map, "white_e_per_s");
  board.black_e_per_s = read_radiance(map, "black_e_per_s");
  board.surround_e_per_s = read_radiance(map, "surround_e_per_s");
  map.finish();
  try {
    BoardPattern{board};
  } catch (const std::invalid_argument& failure) {
    throw print_value.error(failure.what());
  }
  return board;
}

}  // namespace vlp
