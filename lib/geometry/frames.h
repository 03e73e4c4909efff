// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

/// Coordinate frames of the toolbox; all are right-handed.
///   world   Z up, lamps overhead.
///   camera  x right and y down in the image, z out of the lens.
///   level   gravity-aligned: origin of the camera, z exactly up. At yaw 0 its axes are parallel
///           to those of the world: x_in_world = position + Rz(yaw) x_in_level.
/// A rotation is named b_from_a, a vector x_in_a, and x_in_b = b_from_a * x_in_a.
namespace vlp {

/// Pose of a level frame in the world: position of its origin, m, and yaw, rad. x_in_world =
/// position_m + Rz(yaw_rad) x_in_level. Yaw is counter-clockwise seen from above.
struct Pose {
  Eigen::Vector3d position_m;
  double yaw_rad;
};

/// Roll and pitch measured by an inclination sensor (Chen and Guan, eq. 2: alpha, beta). The camera
/// is first pitched about its y axis, then rolled about its new x axis:
///   level_from_camera = Ry(pitch) Rx(roll).
/// This is the order of aircraft angles (yaw, pitch, roll) without the yaw.
struct Inclination {
  double roll_rad;
  double pitch_rad;
};

/// Returns the rotation about z by `yaw_rad`.
Eigen::Matrix3d rotation_about_z(double yaw_rad);

/// Computes level_from_camera from the measurement of an inclination sensor.
Eigen::Matrix3d level_rotation_from_inclination(const Inclination& inclination);

/// Computes level_from_camera from a calibrated tilt: the smallest rotation from
/// `zenith_in_camera` to +Z. It adds no yaw.
///
/// @param zenith_in_camera  up direction in the camera frame, of any length except 0, not -Z
Eigen::Matrix3d level_rotation_from_zenith(const Eigen::Vector3d& zenith_in_camera);

/// Transforms a point from the world frame to the level frame of the pose `level`, in m.
Eigen::Vector3d level_point_from_world(const Pose& level, const Eigen::Vector3d& x_in_world);

}  // namespace vlp
