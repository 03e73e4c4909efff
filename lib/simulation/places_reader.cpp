// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "simulation/scene_parts.h"

namespace vlp {
namespace {

/// Rejects a spot that does not leave space in the room for a rotation of the camera about it.
void check_spot(const Eigen::Vector2d& spot_m, const Room& room, double lever_arm_m,
                const YamlValue& value) {
  const Eigen::Array2d spot = spot_m.array();
  const bool inside = (spot - lever_arm_m >= room.min_m.head<2>().array()).all() &&
                      (spot + lever_arm_m <= room.max_m.head<2>().array()).all();
  if (!inside) throw value.error("takes the camera outside the room");
}

Eigen::Vector2d read_spot(const YamlValue& value, const Room& room, double lever_arm_m) {
  const Eigen::Vector2d spot_m(value.numbers(2).data());
  check_spot(spot_m, room, lever_arm_m, value);
  return spot_m;
}

std::vector<Eigen::Vector2d> read_grid(const YamlValue& value, const Room& room,
                                       double lever_arm_m) {
  YamlMap map = value.map();
  const auto x = map.required("x_m").numbers(2), y = map.required("y_m").numbers(2);
  const int columns = map.required("columns").integer_within(2, 1000);
  const int rows = map.required("rows").integer_within(2, 1000);
  map.finish();
  for (const int end : {0, 1}) {
    check_spot({x[std::size_t(end)], y[std::size_t(end)]}, room, lever_arm_m, value);
  }
  std::vector<Eigen::Vector2d> spots;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      spots.emplace_back(x[0] + (x[1] - x[0]) * column / (columns - 1),
                         y[0] + (y[1] - y[0]) * row / (rows - 1));
    }
  }
  return spots;
}

StraightDrive read_drive(const YamlValue& value, const Room& room, double lever_arm_m) {
  YamlMap map = value.map();
  const StraightDrive drive{read_spot(map.required("from_m"), room, lever_arm_m),
                            read_spot(map.required("to_m"), room, lever_arm_m),
                            map.required("speed_m_per_s").number_within(1e-6, 20, "m/s")};
  map.finish();
  if (drive.from_m == drive.to_m) throw value.error("has no length");
  return drive;
}

std::vector<Eigen::Vector2d> compute_positions_along(const StraightDrive& drive, double interval_s,
                                                     const YamlValue& value) {
  const Eigen::Vector2d displacement = drive.to_m - drive.from_m;
  const double step_m = drive.speed_m_per_s * interval_s;
  constexpr double rounding = 1e-12;
  const double steps = std::floor(displacement.norm() / step_m * (1 + rounding));
  check_count(steps + 1, value);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i <= steps; ++i)
    places.push_back(drive.from_m + displacement.normalized() * (step_m * i));
  return places;
}

}  // namespace

void read_places(YamlMap& map, const Scene& scene, const Room& room, LampShots& captures) {
  const double lever_arm_m = scene.mount.lever_arm_m.norm();
  const auto spots = map.optional("spots_m"), grid = map.optional("grid");
  const auto drive = map.optional("drive");
  if (spots.has_value() + grid.has_value() + drive.has_value() != 1) {
    throw map.error("needs one of the keys spots_m, grid, drive, views");
  }
  if (spots) {
    for (const YamlValue& spot : spots->list()) {
      captures.spots_m.push_back(read_spot(spot, room, lever_arm_m));
    }
    if (captures.spots_m.empty()) throw spots->error("holds no spot");
  } else if (grid) {
    captures.spots_m = read_grid(*grid, room, lever_arm_m);
  } else {
    captures.drive = read_drive(*drive, room, lever_arm_m);
    captures.spots_m = compute_positions_along(*captures.drive, captures.interval_s, *drive);
  }
}

}  // namespace vlp
