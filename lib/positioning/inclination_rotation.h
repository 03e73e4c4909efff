// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"
#include "fix.h"
#include "robot.h"

namespace vlp {

/// Rotation of the camera due to the robot's inclination.
struct InclinationRotation {
  /// Rotation to the level frame from the base: the camera frame after correction of its calibrated
  /// tilt. The identity for a robot that is level.
  Eigen::Matrix3d level_from_base = Eigen::Matrix3d::Identity();
  /// Unit axes in the level frame about which the camera rotates for an error of the roll (column
  /// 0) and of the pitch (column 1).
  Eigen::Matrix<double, 3, 2> error_axes = Eigen::Matrix<double, 3, 2>::Zero();
};

/// Computes the rotation from the readings about the robot's axes and the yaw of the camera on the
/// robot:
///   level_from_base = Rz(-yaw_in_robot) Ry(pitch) Rx(roll) Rz(yaw_in_robot)
/// An error of the pitch rotates about y, an error of the roll about the pitched x axis, (cos p, 0,
/// -sin p).
InclinationRotation compute_inclination_rotation(const Inclination& inclination,
                                                 double yaw_in_robot_rad);

/// Derivatives of (X, Y, Z, yaw), in m and rad, with respect to the errors of roll and pitch of the
/// inclination, in rad. One column each.
using InclinationJacobian = Eigen::Matrix<double, 4, 2>;

/// Computes center and yaw of the robot from the camera pose. With m the position of the mount
/// rotated into the camera's level frame, and inclined as the robot is:
///   robot = S - Rz(g) m,   yaw = g - yaw_in_robot
///
/// @param camera   pose of the camera with the covariance from pixel noise
/// @param d_pose_d_inclination derivative of the camera pose with respect to the inclination; m
///     depends on the inclination, too
PoseEstimate compute_robot_pose_from_camera_pose(const PoseEstimate& camera,
                                                 const InclinationJacobian& d_pose_d_inclination,
                                                 double inclination_sigma_rad,
                                                 const CameraMount& mount,
                                                 const InclinationRotation& rotation);

}  // namespace vlp
