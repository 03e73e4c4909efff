// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lamp_shape.h"

namespace vlp {

struct Lamp {
  int id;
  /// Centre of the lamp in the world frame (Z up).
  Eigen::Vector3d position_m;
  LampShape shape;
  /// Of the square wave that modulates the lamp.
  std::optional<double> frequency_hz;
  /// The lit share of a period.
  std::optional<double> duty;
  /// Standard deviation of position_m per axis, as far as the survey states it.
  std::optional<double> sd_m = {};
};

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
/// The default of shape is disc, which has a diameter_m. Others have a size_m and a yaw_rad, by
/// default 0, see ShapeTraits.
/// Throws InputError: unknown or missing keys, an id that stands twice, two lamps within 1 mm,
/// figures that cannot be in the right unit.
LampMap read_lamp_map(const std::filesystem::path& file);

/// Reads the lamps of one room of a map whose lamps state a `room`, such as
///   - {id: 1, room: hall, position_m: [0.5, -0.3, 2.1], diameter_m: 0.18, frequency_hz: 2000}
/// The frequencies of two rooms may be equal. An empty `room` reads all lamps. Throws InputError as
/// above, if no lamp is in the room, and if a lamp does not state its room.
LampMap read_lamps_of_room(const std::filesystem::path& file, const std::string& room);

/// Writes what read_lamp_map() reads, whole or not at all. Throws InputError.
void write_lamp_map(const std::filesystem::path& file, const LampMap& map);

}  // namespace vlp
