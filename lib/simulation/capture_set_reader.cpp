// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include "geometry/angles.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

/// Largest number of captures of one folder.
constexpr int kMaxCaptures = 1'000'000;

/// Rejects more than kMaxCaptures captures. `where` provides make_yaml_error() for the message.
template <typename Place>
void check_capture_count(double captures, const Place& where) {
  if (captures <= kMaxCaptures) return;
  throw where.make_yaml_error("makes more than " + std::to_string(kMaxCaptures) + " captures");
}

/// Rejects a height at which a light would not be above the camera.
void check_height(const YamlValue& item, double height_m, const Scene& scene) {
  const auto check = [&](const Glow& glow, const std::string& name) {
    if (glow.position_m.z() <= height_m + 1e-3)
      throw item.make_yaml_error(name + " is not above the camera");
  };
  const Clutter& clutter = scene.clutter;
  for (const SceneLamp& lamp : scene.lamps) check(lamp.glow, "lamp " + std::to_string(lamp.id));
  for (const Glow& lamp : clutter.steady_lamps) check(lamp, "a steady lamp");
  for (const Reflection& reflection : clutter.reflections) check(reflection.glow, "a reflection");
  for (const ForeignLight& light : clutter.foreign_lights) check(light.glow, "a foreign light");
}

/// Rejects a pivot that does not leave space in the room for a rotation of the camera about it.
void check_pivot(const Eigen::Vector2d& pivot_m, const Room& room, double lever_arm_m,
                 const YamlValue& value) {
  const Eigen::Array2d pivot = pivot_m.array();
  const bool inside = (pivot - lever_arm_m >= room.min_m.head<2>().array()).all() &&
                      (pivot + lever_arm_m <= room.max_m.head<2>().array()).all();
  if (!inside) throw value.make_yaml_error("moves the camera outside the room");
}

Eigen::Vector2d read_pivot(const YamlValue& value, const Room& room, double lever_arm_m) {
  const Eigen::Vector2d pivot_m(value.read_yaml_numbers(2).data());
  check_pivot(pivot_m, room, lever_arm_m, value);
  return pivot_m;
}

std::vector<Eigen::Vector2d> read_grid(const YamlValue& value, const Room& room,
                                       double lever_arm_m) {
  YamlMap map = value.read_yaml_mapping();
  const auto x = map.get_required_yaml_value("x_m").read_yaml_numbers(2),
             y = map.get_required_yaml_value("y_m").read_yaml_numbers(2);
  const int columns = map.get_required_yaml_value("columns").read_yaml_integer_within(2, 1000);
  const int rows = map.get_required_yaml_value("rows").read_yaml_integer_within(2, 1000);
  map.check_all_yaml_keys_read();
  for (const std::size_t end : {0U, 1U}) check_pivot({x[end], y[end]}, room, lever_arm_m, value);
  std::vector<Eigen::Vector2d> pivots;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      pivots.emplace_back(x[0] + (x[1] - x[0]) * column / (columns - 1),
                          y[0] + (y[1] - y[0]) * row / (rows - 1));
    }
  }
  return pivots;
}

StraightDrive read_straight_drive(const YamlValue& value, const Room& room, double lever_arm_m) {
  const StraightDrive drive = value.convert_yaml_mapping([&](YamlMap& map) {
    return StraightDrive{
        read_pivot(map.get_required_yaml_value("from_m"), room, lever_arm_m),
        read_pivot(map.get_required_yaml_value("to_m"), room, lever_arm_m),
        map.get_required_yaml_value("speed_m_per_s").read_yaml_number_within(1e-6, 20, "m/s")};
  });
  if (drive.from_m == drive.to_m) throw value.make_yaml_error("has no length");
  return drive;
}

std::vector<Eigen::Vector2d> compute_positions_along(const StraightDrive& drive, double interval_s,
                                                     const YamlValue& value) {
  const Eigen::Vector2d displacement = drive.to_m - drive.from_m;
  const double step_m = drive.speed_m_per_s * interval_s;
  constexpr double rounding = 1e-12;
  const double steps = std::floor(displacement.norm() / step_m * (1 + rounding));
  check_capture_count(steps + 1, value);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i <= steps; ++i) {
    places.push_back(drive.from_m + displacement.normalized() * (step_m * i));
  }
  return places;
}

/// Reads the position of the rotation axis at each capture: pivots, a grid or a drive, all inside
/// the room.
void read_capture_positions(YamlMap& map, const Scene& scene, const Room& room,
                            LampShots& captures) {
  const double lever_arm_m = scene.mount.lever_arm_m.norm();
  const auto pivots = map.get_optional_yaml_value("pivots_m"),
             grid = map.get_optional_yaml_value("grid");
  const auto drive = map.get_optional_yaml_value("drive");
  if (pivots.has_value() + grid.has_value() + drive.has_value() != 1) {
    throw map.make_yaml_error("needs one of the keys pivots_m, grid, drive, views");
  }
  if (pivots) {
    for (const YamlValue& pivot : pivots->read_yaml_list()) {
      captures.pivots_m.push_back(read_pivot(pivot, room, lever_arm_m));
    }
    if (captures.pivots_m.empty()) throw pivots->make_yaml_error("contains no pivot");
  } else if (grid) {
    captures.pivots_m = read_grid(*grid, room, lever_arm_m);
  } else {
    captures.drive = read_straight_drive(*drive, room, lever_arm_m);
    captures.pivots_m = compute_positions_along(*captures.drive, captures.interval_s, *drive);
  }
}

void read_capture_heights(const YamlValue& list, const Scene& scene, const Room& room,
                          LampShots& captures) {
  for (const YamlValue& item : list.read_yaml_list()) {
    const double height_m = item.read_yaml_number_within(-200, 200, "m");
    check_height(item, height_m, scene);
    if (height_m < room.min_m.z() || height_m > room.max_m.z()) {
      throw item.make_yaml_error("moves the camera outside the room");
    }
    captures.heights_m.push_back(height_m);
  }
  if (captures.heights_m.empty()) throw list.make_yaml_error("contains no height");
}

void read_yaws(YamlMap& map, LampShots& captures) {
  captures.yaw_jitter_rad = 0;
  const auto yaws = map.get_optional_yaml_value("yaws_deg"),
             turn = map.get_optional_yaml_value("turn");
  if (yaws.has_value() == turn.has_value()) {
    throw map.make_yaml_error("needs one of the keys yaws_deg and turn");
  }
  if (yaws) {
    for (const YamlValue& yaw : yaws->read_yaml_list()) {
      captures.yaws_rad.push_back(rad_from_deg(yaw.read_yaml_number_within(-360, 360, "degrees")));
    }
    if (captures.yaws_rad.empty()) throw yaws->make_yaml_error("contains no yaw");
    return;
  }
  YamlMap keys = turn->read_yaml_mapping();
  const int count = keys.get_required_yaml_value("count").read_yaml_integer_within(1, 100'000);
  captures.yaw_jitter_rad = rad_from_deg(
      keys.get_required_yaml_value("jitter_deg").read_yaml_number_within(0, 180, "degrees"));
  keys.check_all_yaml_keys_read();
  for (int i = 0; i < count; ++i) captures.yaws_rad.push_back(rad_from_deg(360.0 * i / count));
}

Vibration read_vibration(YamlMap& map) {
  return {
      rad_from_deg(
          map.get_required_yaml_value("amplitude_deg").read_yaml_number_within(0, 10, "degrees")),
      map.get_required_yaml_value("frequency_hz").read_yaml_number_within(1e-3, 1000, "Hz")};
}

void read_roll_pitch(YamlMap map, LampShots& captures) {
  const auto ramp = [&](const std::string& key) {
    const auto value = map.get_optional_yaml_value(key);
    if (!value) return std::pair(0.0, 0.0);
    const auto ends = value->read_yaml_numbers_within(2, -85, 85, "degrees");
    return std::pair(rad_from_deg(ends[0]), rad_from_deg(ends[1]));
  };
  captures.roll_rad = ramp("roll_deg");
  captures.pitch_rad = ramp("pitch_deg");
  captures.vibration =
      map.convert_optional_yaml_mapping("vibration", read_vibration).value_or(captures.vibration);
  map.check_all_yaml_keys_read();
}

LampShots read_lamp_captures(YamlMap& map, const Scene& scene, const Room& room) {
  if (scene.lamps.empty()) throw map.make_yaml_error("the scene has no lamps");
  LampShots captures;
  captures.interval_s =
      map.get_required_yaml_value("interval_s").read_yaml_number_within(1e-6, 1e5, "s");
  read_capture_positions(map, scene, room, captures);
  read_capture_heights(map.get_required_yaml_value("heights_m"), scene, room, captures);
  read_yaws(map, captures);
  captures.turn_rate_rad_per_s = rad_from_deg(
      map.get_optional_yaml_number("turn_rate_deg_per_s", -720, 720, "degrees per second")
          .value_or(0));
  if (const auto lean = map.get_optional_yaml_value("roll_pitch"))
    read_roll_pitch(lean->read_yaml_mapping(), captures);
  const auto repeat = map.get_optional_yaml_value("repeat");
  captures.repeat = repeat ? repeat->read_yaml_integer_within(1, kMaxCaptures) : 1;
  const auto known = map.get_optional_yaml_value("known");
  captures.has_known_positions = known && known->read_yaml_boolean();
  check_capture_count(double(captures.pivots_m.size()) * double(captures.heights_m.size()) *
                          double(captures.yaws_rad.size()) * captures.repeat,
                      map);
  if (captures.drive && captures.yaw_jitter_rad > 0) {
    throw map.make_yaml_error("yaws do not jitter on a drive: set jitter_deg to 0");
  }
  return captures;
}

BoardViews read_board_views(YamlMap& map) {
  BoardViews views;
  views.count = map.get_required_yaml_value("count").read_yaml_integer_within(1, kMaxCaptures);
  views.distance_m = read_yaml_range(map.get_required_yaml_value("distance_m"), 1e-3, 100, "m");
  views.tilt_rad = rad_from_deg(
      map.get_required_yaml_value("tilt_deg").read_yaml_number_within(0, 80, "degrees"));
  views.roll_rad = rad_from_deg(
      map.get_required_yaml_value("roll_deg").read_yaml_number_within(0, 180, "degrees"));
  views.field_coverage = map.get_required_yaml_value("field_coverage")
                             .read_yaml_number_within(0, 1, "(of the way to the image's edge)");
  views.velocity_m_per_s.setZero();
  if (const auto velocity = map.get_optional_yaml_value("velocity_m_per_s")) {
    views.velocity_m_per_s =
        Eigen::Vector3d(velocity->read_yaml_numbers_within(3, -10, 10, "m/s").data());
  }
  return views;
}

std::string read_folder(const YamlValue& value) {
  const std::string folder = value.read_yaml_string();
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (folder.empty() || !std::all_of(folder.begin(), folder.end(), plain)) {
    throw value.make_yaml_error("should be a name of letters, digits, - and _");
  }
  return folder;
}

}  // namespace

CaptureSet read_scene_capture_set(YamlMap& map, const Scene& scene, const Room& room) {
  CaptureSet set;
  set.folder = read_folder(map.get_required_yaml_value("folder"));
  set.exposure_s = map.get_required_yaml_value("exposure_s").read_yaml_number_within(1e-7, 1, "s");
  if (const auto views = map.get_optional_yaml_value("views")) {
    if (!scene.board) throw map.make_yaml_error("views are of a board, and the scene has none");
    set.board = views->convert_yaml_mapping(read_board_views);
  } else {
    set.lamps = read_lamp_captures(map, scene, room);
  }
  return set;
}

}  // namespace vlp
