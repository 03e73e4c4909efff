// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/measuring_digest.h"

#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "captures/digest.h"
#include "rig/calibration_text.h"

namespace vlp {
namespace {

/// Text of names and values, one per line. Numbers have the shortest text that is parsed to the
/// same value; texts are preceded by their length.
class Lines {
 public:
  void add(const char* name, double value) { text_ += fmt::format("{} {}\n", name, value); }
  void add(const char* name, const std::string& value) {
    text_ += fmt::format("{} {}:{}\n", name, value.size(), value);
  }
  void add(const char* name, const std::optional<double>& value) {
    if (value) add(name, *value);
  }
  void add(std::initializer_list<std::pair<const char*, double>> values) {
    for (const auto& [name, value] : values) add(name, value);
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

void add_board(const Board& board, Lines& lines) {
  lines.add("board", board.family);
  lines.add("id_order", to_string(board.id_order));
  lines.add({{"kind", static_cast<double>(board.kind)},
             {"cols", board.cols},
             {"rows", board.rows},
             {"tag_size_m", board.tag_size_m},
             {"tag_spacing", board.tag_spacing},
             {"border_bits", board.border_bits},
             {"corner_squares", board.corner_squares ? 1 : 0},
             {"first_id", board.first_id},
             {"square_size_m", board.square_size_m},
             {"top_left_white", board.top_left_white ? 1 : 0}});
}

void add_lamps(LampMap map, Lines& lines) {
  std::sort(map.lamps.begin(), map.lamps.end(),
            [](const Lamp& a, const Lamp& b) { return a.id < b.id; });
  for (const Lamp& lamp : map.lamps) {
    lines.add({{"lamp", lamp.id},
               {"x_m", lamp.position_m.x()},
               {"y_m", lamp.position_m.y()},
               {"z_m", lamp.position_m.z()}});
    const LampShape& shape = lamp.shape;
    const bool is_disc = shape.kind == ShapeKind::disc;
    if (is_disc && shape.size_m) lines.add("diameter_m", shape.size_m->x());
    lines.add("frequency_hz", lamp.frequency_hz);
    lines.add("duty", lamp.duty);
    lines.add("sd_m", lamp.sd_m);
    if (is_disc) continue;
    lines.add("shape", std::string(traits_of(shape.kind).name));
    lines.add({{"length_m", shape.size_m->x()},
               {"width_m", shape.size_m->y()},
               {"yaw_rad", shape.yaw_rad}});
  }
}

void add_gates(const std::vector<Gate>& gates, Lines& lines) {
  for (const Gate& gate : gates) {
    lines.add("gate", gate.metric);
    lines.add("limit", gate.limit);
    if (!gate.guard) continue;
    lines.add({{"u", gate.guard->standard_uncertainty}, {"k", gate.guard->k}});
  }
}

}  // namespace

std::string measuring_digest(const StationConfig& config) {
  Lines lines;
  Calibration type;
  type.camera = config.type;
  lines.add("camera_type", calibration_text(type));
  add_board(config.board, lines);
  add_lamps(config.lamps, lines);
  if (const auto& place_m = config.dispersion_station_m) {
    lines.add({{"station_x_m", place_m->x()}, {"station_y_m", place_m->y()}});
  }
  const CompletionCriteria& sufficient = config.sufficient;
  lines.add({{"board_views", sufficient.board_views},
             {"board_coverage", sufficient.board_coverage},
             {"turn_captures", sufficient.turn_captures},
             {"turn_heights", sufficient.turn_heights},
             {"turn_arc_rad", sufficient.turn_arc_rad},
             {"dispersion_captures", sufficient.dispersion_captures},
             {"check_captures", sufficient.check_captures}});
  const FrontendOptions& limits = config.frontend;
  lines.add({{"blur_px", limits.max_blur_px},
             {"dark_fraction", limits.min_bright_fraction},
             {"same_pose_fraction", limits.same_view_fraction},
             {"max_consecutive_rejections", config.max_consecutive_rejections}});
  // Stations without the key keep their digest.
  if (limits.max_white_fraction != FrontendOptions().max_white_fraction) {
    lines.add("white_fraction", limits.max_white_fraction);
  }
  add_gates(config.gates, lines);
  if (const auto& golden = config.golden) {
    lines.add("golden", golden->camera_id);
    lines.add("calibration", calibration_text(golden->calibration));
    add_gates(golden->gates, lines);
  }
  return sha256_of_text(lines.text());
}

}  // namespace vlp
