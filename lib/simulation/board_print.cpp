// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/board_print.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rig/board_layout.h"
#include "simulation/tag_pattern.h"

namespace vlp {
namespace {

/// What is printed, in the order of printing; the last on a spot is seen.
std::vector<Rectangle> rectangles_of(const SceneBoard& board) {
  const Board& print = board.print;
  const double white = board.white_e_per_s - board.surround_e_per_s;
  const double black = board.black_e_per_s - board.surround_e_per_s;
  const double tag_m = print.tag_size_m, gap_m = tag_m * print.tag_spacing;
  const double margin_m = board.margin_m + (print.corner_squares ? gap_m : 0);
  const Eigen::Vector2d field_m = tag_field_m(print);
  std::vector<Rectangle> all;
  all.push_back({-margin_m, -margin_m, field_m.x() + margin_m, field_m.y() + margin_m, white});
  if (print.corner_squares) {
    for (int row = 0; row <= print.rows; ++row) {
      for (int column = 0; column <= print.cols; ++column) {
        const double right_m = column * tag_pitch_m(print), bottom_m = row * tag_pitch_m(print);
        all.push_back({right_m - gap_m, bottom_m - gap_m, right_m, bottom_m, black});
      }
    }
  }
  for (const BoardTag& tag : board_layout(print)) {
    const TagPattern pattern = tag_pattern(print.family, tag.id, print.border_bits);
    const double bit_m = tag_m / pattern.border_width;
    if (2 * pattern.outside * bit_m > gap_m) {
      throw std::invalid_argument("the gap between the tags is too small for " + print.family);
    }
    const Eigen::Vector2d corner_m =
        tag.corners_m[3] - Eigen::Vector2d::Constant(pattern.outside * bit_m);
    for (int row = 0; row < pattern.width(); ++row) {
      for (int column = 0; column < pattern.width(); ++column) {
        const double left_m = corner_m.x() + column * bit_m, top_m = corner_m.y() + row * bit_m;
        all.push_back({left_m, top_m, left_m + bit_m, top_m + bit_m,
                       pattern.white[pattern.index(column, row)] ? white : black});
      }
    }
  }
  return all;
}

}  // namespace

BoardBend::BoardBend(const SceneBoard& board)
    : field_m_(tag_field_m(board.print)), warp_m_(board.warp_m) {}

BoardBend::Depth BoardBend::depth(const Eigen::Vector2d& at_m) const {
  constexpr double most = 1.5;  // beyond it there is no paper, and a parabola would turn back
  const Eigen::Array2d share = 2 * at_m.array() / field_m_.array() - 1;
  const Eigen::Array2d inside = share.max(-most).min(most);
  const Eigen::Array2d slope =
      (share == inside).select(-4 * warp_m_.array() * inside / field_m_.array(), 0);
  return {warp_m_.dot((1 - inside.square()).matrix()), slope.matrix()};
}

BoardPrint::BoardPrint(const SceneBoard& board) : bend_(board), mosaic_(rectangles_of(board)) {}

Eigen::Vector2d BoardPrint::hit(const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction) const {
  Eigen::Vector2d at_m = plane_hit(origin, direction);
  if (bend_.flat()) return at_m;
  // Newton's method along the ray; two or three steps.
  constexpr double exact_m = 1e-9;
  double distance = -origin.z() / direction.z();
  for (int step = 0; step < 8; ++step) {
    const auto [depth_m, slope] = bend_.depth(at_m);
    const double missed_m = origin.z() + distance * direction.z() - depth_m;
    if (!(std::abs(missed_m) > exact_m)) break;
    distance -= missed_m / (direction.z() - slope.dot(direction.head<2>()));
    at_m = origin.head<2>() + distance * direction.head<2>();
  }
  return at_m;
}

}  // namespace vlp
