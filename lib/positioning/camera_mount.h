// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "fix.h"
#include "inclination_rotation.h"
#include "robot.h"

namespace vlp {

/// Derivatives of (X, Y, Z, yaw) by the errors of roll and pitch of the inclination, a column each.
using InclinationJacobian = Eigen::Matrix<double, 4, 2>;

/// Computes center and yaw of the robot from the camera pose. With m the position of the mount
/// rotated into the camera's level frame, and inclined as the robot is:
///   robot = S - Rz(g) m,   yaw = g - yaw_in_robot
///
/// @param camera   pose of the camera with the covariance from pixel noise
/// @param d_pose_d_inclination  derivative of the camera pose by the inclination; m depends on the
/// inclination, too
PoseEstimate compute_robot_pose(const PoseEstimate& camera,
                                const InclinationJacobian& d_pose_d_inclination,
                                double inclination_sigma_rad, const CameraMount& mount,
                                const InclinationRotation& lean);

}  // namespace vlp
