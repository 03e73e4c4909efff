// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace vlp {

/// Straight drive at constant speed.
struct StraightDrive {
  Eigen::Vector2d from_m, to_m;
  double speed_m_per_s;
};

/// Sinusoidal vibration of roll and pitch.
struct Vibration {
  double amplitude_rad, frequency_hz;
};

/// Captures of the lamps, on spots or on a drive; the last-named index changes fastest.
///   On spots: at each height, at each spot, at each yaw, `repeat` captures.
///   On a drive: at each height, at each yaw, `repeat` passes, with a capture every interval_s.
struct LampShots {
  std::vector<double> heights_m;
  /// Position of the rotation axis in the world; on a drive, at each capture of a pass.
  std::vector<Eigen::Vector2d> spots_m;
  std::optional<StraightDrive> drive;
  std::vector<double> yaws_rad;
  /// Amplitude of the uniform random error of each yaw.
  double yaw_jitter_rad;
  /// Yaw rate during each capture; on a drive also between captures.
  double turn_rate_rad_per_s;
  int repeat;
  /// Time from one capture to the next.
  double interval_s;
  /// True if captures.csv contains the exact camera position, as from a fixture that holds the
  /// camera itself.
  bool known;
  /// Roll and pitch of the base at the first and at the last capture, linear in between, and their
  /// vibration.
  std::pair<double, double> roll_rad{0, 0}, pitch_rad{0, 0};
  Vibration vibration{0, 0};
};

/// Random views of the board from all sides.
struct BoardViews {
  int count;
  /// Minimum and maximum distance from the camera to the board's center.
  std::pair<double, double> distance_m;
  /// Largest angle between the board's normal and the line of sight, and largest rotation about the
  /// normal.
  double tilt_rad, roll_rad;
  /// Range of the board's center over the image: 0 for the image center, 1 up to the image edges.
  double spread;
  /// Velocity of the board relative to the camera, in the camera frame.
  Eigen::Vector3d velocity_m_per_s;
};

/// Captures of one folder, either of the lamps or of the board.
struct CaptureSet {
  std::string folder;
  double exposure_s;
  std::optional<LampShots> lamps;
  std::optional<BoardViews> board;
};

}  // namespace vlp
