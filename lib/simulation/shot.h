// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// Exposure times of the lines of a sensor. Time 0 is the middle of the middle line's exposure. An
/// exposure is divided into `count` equal time samples. sample_begin_s(), sample_end_s() and
/// part_middle_s() are the begin, end and middle of sample `index`.
struct Shutter {
  double row_time_s, exposure_s;
  int lines;
  int index = 0, count = 1;

  /// Returns the time of the middle of a line's exposure, s, relative to that of the middle line.
  /// `line` counts from 0 and may be fractional or outside the image.
  double line_center_s(double line) const { return (line - (lines - 1) / 2.0) * row_time_s; }
  /// Returns the begin of time sample `index` of a line's exposure, s, on the same time scale.
  double sample_begin_s(int line) const {
    return line_center_s(line) + (double(index) / count - 0.5) * exposure_s;
  }
  double sample_end_s(int line) const { return sample_begin_s(line) + exposure_s / count; }
  double part_middle_s(int line) const { return (sample_begin_s(line) + sample_end_s(line)) / 2; }
};

/// Motion of the camera on its base during a capture. Time 0 is the middle of the exposure of the
/// image's middle row (or column), which is the time stamp of the capture.
struct BaseMotion {
  /// Position of the vertical axis at time 0, at the height of the camera, in the world.
  Eigen::Vector3d axis_m;
  Eigen::Vector2d velocity_m_per_s;
  double yaw_rad;
  double turn_rate_rad_per_s;
  Mount mount;
  /// Roll and pitch of the base about the camera, in addition to the tilt of the mount, at time 0
  /// and without the vibration. The vibrations of roll and pitch are a quarter of a period apart.
  Inclination inclination{0, 0};
  Vibration vibration{0, 0};
  /// Phase of the vibration at time 0.
  double phase_rad = 0;

  bool is_base_at_rest() const {
    return velocity_m_per_s.isZero(0) && turn_rate_rad_per_s == 0 && vibration.amplitude_rad == 0;
  }
  bool is_base_level() const {
    return inclination.roll_rad == 0 && inclination.pitch_rad == 0 && vibration.amplitude_rad == 0;
  }
  Inclination inclination_at(double time_s) const;
  /// Returns the velocity of the camera, on its lever arm, in the world at time 0.
  Eigen::Vector2d camera_velocity_m_per_s() const;
  Pose camera_pose_at(double time_s) const;
  Eigen::Isometry3d world_from_camera(double time_s) const;
};

/// Capture of the lamps, with all random values.
struct LampShot {
  std::string image;
  double time_s;
  double exposure_s;
  BaseMotion motion;
  /// Waves of Scene::lamps, in their order; time 0 is time_s.
  std::vector<SquareWave> waves;
  std::uint64_t noise_seed;
  /// Waves of Clutter::foreign_lights, in their order; time 0 is time_s.
  std::vector<LightWave> foreign_waves = {};
  /// Phase of Clutter::ambient_flicker at time_s, in periods.
  double ambient_phase = 0;
};

/// Capture of the board.
struct BoardShot {
  std::string image;
  double exposure_s;
  Eigen::Isometry3d camera_from_board_at_0;
  Eigen::Vector3d velocity_in_camera_m_per_s;
  std::uint64_t noise_seed;

  Eigen::Isometry3d camera_from_board(double time_s) const;
};

/// Returns the number of captures of a set.
std::size_t count_shots(const CaptureSet& set);

/// Returns capture `index` of a set. It depends on the scene, its seed, the set's folder and the
/// index alone.
/// @pre index < count_shots(set)
LampShot make_lamp_shot(const Scene& scene, const CaptureSet& set, std::size_t index);
BoardShot make_board_shot(const Scene& scene, const CaptureSet& set, std::size_t index);

}  // namespace vlp
