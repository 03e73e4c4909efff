// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

/// The frames of the toolbox; all are right-handed.
///   world   Z up, the lamps overhead.
///   camera  x right and y down in the image, z out of the lens.
///   level   the camera's origin, z exactly up. At yaw 0 its axes are the world's:
///           x_in_world = position + Rz(yaw) x_in_level.
/// A rotation is called b_from_a, a vector x_in_a, and x_in_b = b_from_a * x_in_a.
namespace vlp {

/// Where a level frame stands. Yaw is counter-clockwise seen from above.
struct Pose {
  Eigen::Vector3d position_m;
  double yaw_rad;
};

/// Reading of an inclination sensor (Chen and Guan, eq. 2: alpha, beta). The camera is first
/// pitched about its y axis, then rolled about its new x axis:
///   level_from_camera = Ry(pitch) Rx(roll),
/// which is the order of aircraft angles (yaw, pitch, roll) with the yaw taken off.
struct Inclination {
  double roll_rad;
  double pitch_rad;
};

/// Rotation about z by `yaw_rad`.
Eigen::Matrix3d rotation_about_z(double yaw_rad);

/// level_from_camera of an inclination sensor.
Eigen::Matrix3d level_from_inclination(const Inclination& inclination);

/// level_from_camera of a calibrated tilt: the smallest rotation that turns `zenith_in_camera`
/// (the direction of up; any length but zero, not -Z) to +Z. It adds no yaw.
Eigen::Matrix3d level_from_zenith(const Eigen::Vector3d& zenith_in_camera);

/// x_in_level of a world point seen from `level`.
Eigen::Vector3d level_from_world(const Pose& level, const Eigen::Vector3d& x_in_world);

}  // namespace vlp
