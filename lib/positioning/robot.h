// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

/// What a robot knows of itself, and not from an image.
namespace vlp {

/// How the camera sits on the robot. The robot's frame has z up at its centre; the camera stands at
/// `position_in_robot_m`, its yaw turned by `yaw_in_robot_rad` against the robot's.
struct CameraMount {
  Eigen::Vector3d position_in_robot_m;
  double yaw_in_robot_rad;
};

/// Height and yaw of the camera, with their standard deviations; 0: exact. Fixes take the errors of
/// different frames as independent.
struct HeightAndYaw {
  double z_m;
  double yaw_rad;
  double z_sd_m = 0;
  double yaw_sd_rad = 0;
};

/// A height known with a standard deviation.
struct KnownHeight {
  double z_m;
  /// Positive.
  double sd_m;
};

}  // namespace vlp
