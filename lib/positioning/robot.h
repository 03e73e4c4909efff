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

/// Its camera's height and heading.
struct HeightAndYaw {
  double z_m;
  double yaw_rad;
};

/// A height known with a standard deviation.
struct KnownHeight {
  double z_m;
  /// Positive.
  double sd_m;
};

}  // namespace vlp
