// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <string_view>

#include "rig/calibration.h"

namespace vlp {

/// Returns the covariance of RotationCenter::center_px, px^2, with an exact lens. `covariance` is
/// that of the zenith's normalized point, and possibly of the lever arm.
inline Matrix2 center_covariance_px2(const MatrixX& covariance, const Camera& camera) {
  const Eigen::Matrix2d focal_px = camera.focal_px().asDiagonal();
  return focal_px * covariance.topLeftCorner<2, 2>() * focal_px;
}

/// Returns the derivative of a pair of parameters with respect to the lens: C_pl C_ll^-1.
/// @pre the lens has `intrinsics` parameters with positive variances
inline MatrixX derivative_by_lens(const JointCovariance& joint, std::string_view first_parameter,
                                  Eigen::Index intrinsics) {
  const Eigen::Index row = joint.find_row(first_parameter).value();
  return joint.matrix.topLeftCorner(intrinsics, intrinsics)
      .ldlt()
      .solve(joint.matrix.block(0, row, intrinsics, 2))
      .transpose();
}

}  // namespace vlp
