// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "geometry/angles.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

std::string length(double value_m) { return fixed(value_m, 9); }
std::string angle(double value_rad) { return fixed(value_rad, 10); }
std::string pixel(double value_px) { return fixed(value_px, 6); }

std::size_t write_lamp_truth(const Scene& scene, const FrameRenderer& renderer,
                             const CaptureSet& set, const std::filesystem::path& folder) {
  // Columns that no capture of the set needs are omitted.
  bool moves = false, has_roll_pitch = false;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const BaseMotion motion = make_lamp_shot(scene, set, i).motion;
    moves = moves || !motion.at_rest();
    has_roll_pitch = has_roll_pitch || !motion.is_level();
  }
  std::vector<std::string> columns{"image", "x_m", "y_m", "z_m", "yaw_rad"};
  if (moves) {
    columns.insert(columns.end(), {"time_s", "vx_m_per_s", "vy_m_per_s", "yaw_rate_rad_per_s"});
  }
  if (has_roll_pitch) columns.insert(columns.end(), {"roll_rad", "pitch_rad"});
  CsvWriter truth(folder / "truth.csv", columns);
  CsvWriter detections(folder / "true_detections.csv",
                       {"image", "lamp", "u_px", "v_px", "in_view"});
  const bool known = set.lamps->known;
  CsvWriter captures(
      folder / "captures.csv",
      known ? std::initializer_list<std::string_view>{"image", "time_s", "x_m", "y_m", "z_m"}
            : std::initializer_list<std::string_view>{"image", "time_s"});
  std::size_t empty = 0;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const LampShot shot = make_lamp_shot(scene, set, i);
    const auto& [position_m, yaw_rad] = shot.motion.pose(0);
    const std::string x = length(position_m.x()), y = length(position_m.y());
    const std::string z = length(position_m.z()), time = fixed(shot.time_s, 9);
    std::vector<std::string> row{shot.image, x, y, z, angle(wrap_rad(yaw_rad))};
    if (moves) {
      const Eigen::Vector2d velocity_m_per_s = shot.motion.camera_velocity_m_per_s();
      row.insert(row.end(), {time, length(velocity_m_per_s.x()), length(velocity_m_per_s.y()),
                             angle(shot.motion.turn_rate_rad_per_s)});
    }
    if (has_roll_pitch) {
      const Inclination lean = shot.motion.inclination(0);
      row.insert(row.end(), {angle(lean.roll_rad), angle(lean.pitch_rad)});
    }
    truth.row(row);
    if (known) {
      captures.row({shot.image, time, x, y, z});
    } else {
      captures.row({shot.image, time});
    }
    const auto lamps = find_true_lamps(scene, renderer, shot);
    empty += lamps.empty();
    for (const auto& [id, at_px, in_view] : lamps) {
      detections.row({shot.image, std::to_string(id), pixel(at_px.x()), pixel(at_px.y()),
                      significant(in_view, 3)});
    }
  }
  truth.save();
  detections.save();
  captures.save();
  return empty;
}

void write_other_lights(const Scene& scene, const FrameRenderer& renderer, const CaptureSet& set,
                        const std::filesystem::path& folder) {
  if (scene.clutter.mirrors.empty() && scene.clutter.foreign_lights.empty()) return;
  CsvWriter table(folder / "true_other_lights.csv",
                  {"image", "kind", "lamp", "u_px", "v_px", "in_view"});
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const LampShot shot = make_lamp_shot(scene, set, i);
    for (const auto& [kind, lamp, at_px, in_view] : find_true_other_lights(scene, renderer, shot)) {
      table.row({shot.image, std::string(to_string(kind)), lamp ? std::to_string(*lamp) : "",
                 pixel(at_px.x()), pixel(at_px.y()), significant(in_view, 3)});
    }
  }
  table.save();
}

std::size_t write_board_truth(const Scene& scene, const FrameRenderer& renderer,
                              const CaptureSet& set, const std::filesystem::path& folder) {
  CsvWriter boards(folder / "true_boards.csv",
                   {"image", "x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"});
  std::vector<std::string> columns{"image", "tag", "corner", "u_px", "v_px"};
  if (scene.board->print.has_squares()) columns.erase(columns.begin() + 1);
  CsvWriter corners(folder / "true_corners.csv", columns);
  std::size_t empty = 0;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const BoardShot shot = make_board_shot(scene, set, i);
    const Eigen::Isometry3d camera_from_board = shot.camera_from_board(0);
    const Eigen::Vector3d place_m = camera_from_board.translation();
    const Eigen::AngleAxisd rotation(camera_from_board.linear());
    const Eigen::Vector3d rotation_vector_rad = rotation.angle() * rotation.axis();
    boards.row({shot.image, length(place_m.x()), length(place_m.y()), length(place_m.z()),
                angle(rotation_vector_rad.x()), angle(rotation_vector_rad.y()),
                angle(rotation_vector_rad.z())});
    const auto visible_corners = find_true_corners(scene, renderer, shot);
    empty += visible_corners.empty();
    for (const auto& [tag, corner, at_px] : visible_corners) {
      std::vector<std::string> row{shot.image};
      if (tag) row.push_back(std::to_string(*tag));
      row.insert(row.end(), {std::to_string(corner), pixel(at_px.x()), pixel(at_px.y())});
      corners.row(row);
    }
  }
  boards.save();
  corners.save();
  return empty;
}

}  // namespace

std::size_t write_truth(const Scene& scene, const FrameRenderer& renderer, const CaptureSet& set,
                        const std::filesystem::path& folder) {
  if (set.board) {
    return write_board_truth(scene, renderer, set, folder);
  }
  write_other_lights(scene, renderer, set, folder);
  return write_lamp_truth(scene, renderer, set, folder);
}

}  // namespace vlp
