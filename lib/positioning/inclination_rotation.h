// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"

namespace vlp {

/// Computes the rotation to the level frame from the base, the camera frame after correction of its
/// calibrated tilt, from the readings about the robot's axes and the yaw of the camera on the
/// robot:
///   level_from_base = Rz(-yaw_in_robot) Ry(pitch) Rx(roll) Rz(yaw_in_robot)
Eigen::Matrix3d compute_level_from_base(const Inclination& inclination, double yaw_in_robot_rad);

}  // namespace vlp
