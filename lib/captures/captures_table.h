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

/// Point with the known position: the camera, or the axis of rotation, which is at the camera's
/// position minus the lever arm.
enum class MeasuredPoint { camera, axis };

/// Row of captures.csv: sensor data of one capture, the known position of the camera or of the axis
/// of rotation (`place`), and the camera's yaw. Optional values are std::nullopt if the field is
/// empty or the column is missing.
struct Capture {
  std::optional<double> time_s;
  /// Known position in the world, m, of the point `measured_point`: the camera or the axis of
  /// rotation. `yaw_rad` is the yaw of the camera.
  std::optional<double> x_m, y_m, z_m, yaw_rad;
  MeasuredPoint measured_point = MeasuredPoint::camera;
  /// Standard deviation of the position per axis, if known.
  std::optional<double> position_sd_m;
  /// Name of the rotation in place to which the capture belongs (column pivot): captures of one
  /// name share axis and height. May be empty.
  std::string pivot;
  /// Reading of the inclination sensor: roll_rad and pitch_rad, both or neither.
  std::optional<Inclination> inclination;
  /// Odometry in the level frame of the robot, or, without a mount, of the camera: vx_m_per_s and
  /// vy_m_per_s, both or neither, and their standard deviation per component.
  std::optional<Eigen::Vector2d> velocity_m_per_s;
  std::optional<double> yaw_rate_rad_per_s, velocity_sd_m_per_s;
};

/// Captures by image name.
using CapturesTable = std::map<std::string, Capture>;

/// Reads `captures.csv`. Columns: image, then any of time_s, x_m, y_m, z_m, yaw_rad,
/// reference_point, position_sd_m, pivot, roll_rad, pitch_rad, vx_m_per_s, vy_m_per_s,
/// yaw_rate_rad_per_s, velocity_sd_m_per_s. A field may be empty.
/// @throws InputError as CsvTable; if an image occurs twice; if only one of roll_rad and pitch_rad,
/// or of the velocities, is given; if a reference point is neither camera nor axis; if a standard
/// deviation is negative or has no velocity
CapturesTable read_captures_csv(const std::filesystem::path& file);

/// Reads the captures.csv of a folder; returns an empty table if there is none. Throws InputError.
CapturesTable read_folder_captures(const std::filesystem::path& folder);

/// Writes a `captures.csv` with the time of each image. Throws InputError if it cannot be written.
void write_capture_times(const std::filesystem::path& file,
                         const std::map<std::string, double>& times_s);

}  // namespace vlp
