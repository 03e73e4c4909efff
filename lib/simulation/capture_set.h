// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace vlp {

/// A straight way at constant speed.
struct StraightDrive {
  Eigen::Vector2d from_m, to_m;
  double speed_m_per_s;
};

struct Vibration {
  double amplitude_rad, frequency_hz;
};

/// Captures of the lamps. On spots: at each height, at each spot, at each yaw, so many times; the
/// last changes fastest. On a drive: at each height, at each yaw, so many passes along it, with a
/// capture every interval.
struct LampShots {
  std::vector<double> heights_m;
  /// Where the axis stands, or comes by on its drive.
  std::vector<Eigen::Vector2d> spots_m;
  std::optional<StraightDrive> drive;
  std::vector<double> yaws_rad;
  /// Each yaw is off by up to so much, at random.
  double yaw_jitter_rad;
  /// During each capture; on a drive also from one to the next.
  double turn_rate_rad_per_s;
  int repeat;
  /// From one capture to the next.
  double interval_s;
  /// Whether captures.csv tells where the camera is: exactly, as a fixture that holds the camera
  /// itself would know it.
  bool known;
  /// How the carrier leans, from the first capture evenly to the last, and how that vibrates.
  std::pair<double, double> roll_rad{0, 0}, pitch_rad{0, 0};
  Vibration vibration{0, 0};
};

/// Views of the board from all sides, chosen at random.
struct BoardViews {
  int count;
  /// From the camera to the board's middle, least and most.
  std::pair<double, double> distance_m;
  /// Largest angle between the board's normal and the line of sight, and of turns about it.
  double tilt_rad, roll_rad;
  /// How far out the board's middle goes: 0 the image's middle, 1 its edges.
  double spread;
  /// Of the board against the camera.
  Eigen::Vector3d velocity_m_per_s;
};

/// The captures of one folder: of the lamps or of the board.
struct CaptureSet {
  std::string folder;
  double exposure_s;
  std::optional<LampShots> lamps;
  std::optional<BoardViews> board;
};

}  // namespace vlp
