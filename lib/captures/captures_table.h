// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "geometry/frames.h"

namespace vlp {

/// What is known of a capture besides its image.
struct Capture {
  std::optional<double> time_s;
  /// Where the camera is known to be.
  std::optional<double> x_m, y_m, z_m, yaw_rad;
  /// From the inclination sensor: roll_rad and pitch_rad, both or neither.
  std::optional<Inclination> inclination;
};

/// Captures by the name of their image.
using CapturesTable = std::map<std::string, Capture>;

/// Reads `captures.csv`: the column image, then any of time_s, x_m, y_m, z_m, yaw_rad, roll_rad,
/// pitch_rad; a field may be empty. Throws InputError: see CsvTable; an image twice; one of
/// roll_rad and pitch_rad without the other.
CapturesTable read_captures(const std::filesystem::path& file);

}  // namespace vlp
