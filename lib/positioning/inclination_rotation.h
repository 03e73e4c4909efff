// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"

namespace vlp {

/// Rotation of the camera due to the robot's inclination.
struct InclinationRotation {
  /// From the camera's frame, corrected for its calibrated tilt, to its level frame.
  Eigen::Matrix3d level_from_base = Eigen::Matrix3d::Identity();
  /// Rotation axes in the level frame of an error of the roll and of an error of the pitch.
  Eigen::Matrix<double, 3, 2> error_axes = Eigen::Matrix<double, 3, 2>::Zero();
};

/// Computes the rotation from the readings about the robot's axes and the yaw of the camera on the
/// robot:
///   level_from_base = Rz(-yaw_in_robot) Ry(pitch) Rx(roll) Rz(yaw_in_robot)
/// An error of the pitch rotates about y, an error of the roll about the pitched x axis, (cos p, 0,
/// -sin p).
InclinationRotation compute_inclination_rotation(const Inclination& inclination,
                                                 double yaw_in_robot_rad);

}  // namespace vlp
