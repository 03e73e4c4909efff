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

/// Lamp of the map: id, position, shape and modulation, as surveyed.
struct Lamp {
  int id;
  /// Center of the lamp in the world frame (Z up), m.
  Eigen::Vector3d position_m;
  LampShape shape;
  /// Frequency of the square wave that modulates the lamp; std::nullopt if unknown.
  std::optional<double> frequency_hz;
  /// Duty cycle: lit fraction of a period, 0 to 1; std::nullopt if unknown.
  std::optional<double> duty;
  /// Standard deviation of position_m per axis; std::nullopt if the survey does not report it.
  std::optional<double> sd_m = {};
};

/// Lamps of a room, in the order of the file. Ids are unique, and no two lamps coincide.
struct LampMap {
  std::vector<Lamp> lamps;
  /// True if the camera is above the lamps and looks down, for example at a board on the floor. The
  /// axes of the camera are then x right, y up in the image, and z up, against the line of sight:
  /// yaw, roll and pitch are 0 if it looks straight down with the image's x along the world's.
  bool lamps_below_camera = false;
};

/// Reads `vlp-lamps/1`:
///   format: vlp-lamps/1
///   sd_m: 0.002                # of the survey, for all lamps without sd_m
///   lamps_below_camera: false  # true: LampMap::lamps_below_camera
///   lamps:
///     - {id: 1, position_m: [0.5, -0.3, 2.1], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5}
///     - {id: 2, position_m: [0, 1, 2.1], shape: rectangle, size_m: [1.2, 0.1], yaw_rad: 0.3}
/// The default shape is disc, with a diameter_m. Other shapes have a size_m and a yaw_rad, by
/// default 0, see ShapeTraits.
/// @throws InputError if a key is unknown or missing; if an id occurs twice; if two lamps are
///     within 1 mm; if the unit of a value is implausible
LampMap read_lamp_map(const std::filesystem::path& file);

/// Reads the lamps of one room, from a map whose lamps have a `room`, such as
///   - {id: 1, room: hall, position_m: [0.5, -0.3, 2.1], diameter_m: 0.18, frequency_hz: 2000}
/// Lamps of different rooms may have equal frequencies. An empty `room` reads all lamps.
/// @throws InputError as read_lamp_map(), if no lamp is in the room, or if a lamp has no `room`
LampMap read_lamps_of_room(const std::filesystem::path& file, const std::string& room);

/// Writes a file for read_lamp_map(), atomically. Throws InputError if it cannot be written.
void write_lamp_map(const std::filesystem::path& file, const LampMap& map);

}  // namespace vlp
