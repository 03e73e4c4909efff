// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

namespace vlp {

/// OpenCV's distortion of the normalized plane z = (x/Z, y/Z), with r2 = |z|^2:
///   L  = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
///   x' = x L + 2 p1 x y + p2 (r2 + 2 x^2) + s1 r2 + s2 r2^2
///   y' = y L + p1 (r2 + 2 y^2) + 2 p2 x y + s3 r2 + s4 r2^2
/// Source: OpenCV's calib3d documentation, "Detailed Description"; mrcal's OPENCV4 to OPENCV12
/// are this with the missing coefficients zero.
struct Distortion {
  /// k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.
  std::array<double, 12> k{};

  struct Value {
    Eigen::Vector2d distorted;
    Eigen::Matrix2d d_distorted_d_z;
  };
  Value operator()(const Eigen::Vector2d& z) const;

  /// L.
  double radial_factor(double r2) const {
    return (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) /
           (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  }

  /// Derivative of the distorted point by the twelve coefficients.
  Eigen::Matrix<double, 2, 12> coefficient_jacobian(const Eigen::Vector2d& z) const;

  /// The smallest r at which, in some direction, the distorted point stops moving outwards as z
  /// does; r L(r^2) alone decides when the tangential and prism terms are zero. Beyond it two rays
  /// share a pixel, and the model describes no lens. Infinite when there is none up to
  /// searched_radius.
  double valid_radius() const;
  static constexpr double searched_radius = 10;  // tan 84 degrees
};

}  // namespace vlp
