// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"

namespace vlp {

/// Computes the rotation to the level frame from the base, which is the camera frame after
/// correction of its calibrated tilt. `inclination` is about the robot's axes, `yaw_in_robot_rad`
/// the yaw of the camera relative to the robot.
///   level_from_base = Rz(-yaw_in_robot) Ry(pitch) Rx(roll) Rz(yaw_in_robot)
Eigen::Matrix3d compute_level_from_base(const Inclination& inclination, double yaw_in_robot_rad);

}  // namespace vlp
