// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace vlp {

/// Returns the cross-product matrix: v x w = skew_symmetric_matrix(v) w.
inline Eigen::Matrix3d skew_symmetric_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

/// Returns the rotation matrix exp(r) of a rotation vector r: right-handed rotation about the axis
/// r / |r| by the angle |r|, rad. Returns the identity for r = 0.
inline Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

/// Returns the left Jacobian J of the rotations: exp(r + dr) = exp(J dr) exp(r), to first order in
/// dr.
inline Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  constexpr double tiny = 1e-6;
  if (angle < tiny) return Eigen::Matrix3d::Identity() + skew_symmetric_matrix(r) / 2;
  const Eigen::Matrix3d k = skew_symmetric_matrix(r / angle);
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / angle * k +
         (1 - std::sin(angle) / angle) * k * k;
}

}  // namespace vlp
