// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "geometry/frames.h"

namespace vlp {

/// Whose place is known. The axis stands where the lever arm, taken off, puts the camera.
enum class PlaceOf { camera, axis };

/// What is known of a capture besides its image.
struct Capture {
  std::optional<double> time_s;
  /// Where the camera, or the axis that it turns about, is known to be; the yaw is the camera's.
  std::optional<double> x_m, y_m, z_m, yaw_rad;
  PlaceOf place = PlaceOf::camera;
  /// Standard deviation of the place per axis, as far as it is stated.
  std::optional<double> place_sd_m;
  /// Captures with one name were taken turning on one spot, at one height; may be empty.
  std::string spot;
  /// From the inclination sensor: roll_rad and pitch_rad, both or neither.
  std::optional<Inclination> inclination;
  /// From odometry, in the level frame of the robot, or, without a mount, of the camera: vx_m_per_s
  /// and vy_m_per_s, both or neither, and their standard deviation per component.
  std::optional<Eigen::Vector2d> velocity_m_per_s;
  std::optional<double> yaw_rate_rad_per_s, velocity_sd_m_per_s;
};

/// Captures by the name of their image.
using CapturesTable = std::map<std::string, Capture>;

/// Reads `captures.csv`: the column image, then any of time_s, x_m, y_m, z_m, yaw_rad, place,
/// place_sd_m, spot, roll_rad, pitch_rad, vx_m_per_s, vy_m_per_s, yaw_rate_rad_per_s,
/// velocity_sd_m_per_s; a field may be empty. Throws InputError: see CsvTable; an image twice; one
/// of roll_rad and pitch_rad, or of the velocities, without the other; a place that is neither
/// camera nor axis; a standard deviation that is negative or of no velocity.
CapturesTable read_captures(const std::filesystem::path& file);

/// Reads the captures.csv of a folder; returns an empty table if there is none. Throws InputError.
CapturesTable captures_table(const std::filesystem::path& folder);

/// Writes a `captures.csv` that tells when each image was taken. Throws InputError.
void write_times(const std::filesystem::path& file, const std::map<std::string, double>& times_s);

}  // namespace vlp
