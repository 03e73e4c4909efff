// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <vector>

namespace vlp {

/// A horizontal rectangle, as panels and tubes are.
struct LampRectangle {
  /// Along its own two axes.
  Eigen::Vector2d size_m;
  /// Of its first axis from the world's x, counter-clockwise seen from above.
  double yaw_rad;
};

struct Lamp {
  int id;
  /// Centre of the lamp in the world frame (Z up).
  Eigen::Vector3d position_m;
  /// Of a disc.
  std::optional<double> diameter_m;
  /// Of the square wave that modulates the lamp.
  std::optional<double> frequency_hz;
  /// The lit share of a period.
  std::optional<double> duty;
  /// Standard deviation of position_m per axis, as far as the survey states it.
  std::optional<double> sd_m = {};
  /// Of a lamp that is one; any other is a disc.
  std::optional<LampRectangle> rectangle = {};
};

/// The rectangle's corners in the world, around it, counter-clockwise seen from above.
std::array<Eigen::Vector3d, 4> corners_of(const LampRectangle& rectangle,
                                          const Eigen::Vector3d& center_m);

/// The lamps of a room, in the order of the file. Ids are unique, no two lamps coincide.
struct LampMap {
  std::vector<Lamp> lamps;
};

/// Reads `vlp-lamps/1`:
///   format: vlp-lamps/1
///   sd_m: 0.002            # of the survey, of all lamps that state none of their own
///   lamps:
///     - {id: 1, position_m: [0.5, -0.3, 2.1], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5}
///     - {id: 2, position_m: [0, 1, 2.1], shape: rectangle, size_m: [1.2, 0.1], yaw_rad: 0.3}
/// shape is disc, also where it is left out, or rectangle, which has a size_m, and a yaw_rad of 0
/// where it is left out, and no diameter_m.
/// Throws InputError: unknown or missing keys, an id that stands twice, two lamps within 1 mm,
/// figures that cannot be in the right unit.
LampMap read_lamp_map(const std::filesystem::path& file);

/// Writes what read_lamp_map() reads, whole or not at all. Throws InputError.
void write_lamp_map(const std::filesystem::path& file, const LampMap& map);

}  // namespace vlp
