// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"

namespace vlp {

/// How the robot's inclination turns what its camera sees.
struct InclinationRotation {
  /// From the camera's frame, its calibrated tilt taken off, to its level frame.
  Eigen::Matrix3d level_from_base = Eigen::Matrix3d::Identity();
  /// About which axis of the level frame an error of the roll, and one of the pitch, turns it.
  Eigen::Matrix<double, 3, 2> error_axes = Eigen::Matrix<double, 3, 2>::Zero();
};

/// The sensor reads about the robot's axes, the camera's yaw on the robot is `yaw_in_robot_rad`:
///   level_from_base = Rz(-yaw_in_robot) Ry(pitch) Rx(roll) Rz(yaw_in_robot).
/// An error of the pitch turns about y, one of the roll about the pitched x, (cos p, 0, -sin p).
InclinationRotation inclination_rotation(const Inclination& inclination, double yaw_in_robot_rad);

}  // namespace vlp
