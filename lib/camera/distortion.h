// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

namespace vlp {

/// OpenCV's distortion of a point z = (x, y) = (X/Z, Y/Z) of the normalized plane, with
/// r2 = |z|^2:
///   L  = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
///   x' = x L + 2 p1 x y + p2 (r2 + 2 x^2) + s1 r2 + s2 r2^2
///   y' = y L + p1 (r2 + 2 y^2) + 2 p2 x y + s3 r2 + s4 r2^2
/// mrcal's OPENCV4 to OPENCV12 are this model with the missing coefficients set to 0.
/// Source: OpenCV's calib3d documentation, "Detailed Description".
struct Distortion {
  /// Coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 in OpenCV's order: radial (k), tangential (p)
  /// and thin prism (s). Dimensionless; 0 by default.
  std::array<double, 12> k{};

  struct Value {
    Eigen::Vector2d distorted;
    Eigen::Matrix2d d_distorted_d_z;
  };
  /// Computes the distorted point (x', y') of z in the normalized plane and its derivative with
  /// respect to z.
  Value operator()(const Eigen::Vector2d& z) const;

  /// Returns the radial factor L of Distortion at r2 = |z|^2.
  double radial_factor(double r2) const {
    return (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) /
           (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  }

  /// Computes the derivative of the distorted point (x', y') of z with respect to the twelve
  /// coefficients, one column each in the order of `k`.
  Eigen::Matrix<double, 2, 12> coefficient_jacobian(const Eigen::Vector2d& z) const;

  /// Computes the radius r = |z| up to which the model is one to one. It is the smallest r at which
  /// the distorted point stops moving outwards in some direction while z moves outwards. Beyond it
  /// two rays share a pixel, and the model describes no lens. Without tangential and prism terms
  /// only r L(r^2) matters. Returns infinity if there is no such radius up to searched_radius.
  double compute_max_radius() const;
  static constexpr double searched_radius = 10;  // tan 84 degrees
};

}  // namespace vlp
