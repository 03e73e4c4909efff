// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "types.h"

namespace vlp {

/// Circle in the plane, in any unit.
struct Circle {
  Eigen::Vector2d center;
  double radius;
};

/// Circle fitted to points by fit_circle(), with RMS distance and covariance. Lengths are in the
/// unit of the points.
struct CircleFit {
  Circle circle;
  /// RMS distance of the points from the circle.
  double rms;
  /// Covariance of the center, estimated from the residuals: s^2 (J^T J)^-1 with
  /// s^2 = sum of squares / (n - 3). Symmetric 2x2. Infinite for three points, which have no
  /// residuals.
  Matrix2 center_covariance;
  bool converged;
};

/// Fits a circle to points by minimizing the sum of the squared distances of the points from the
/// circle (geometric fit). The initial circle is Taubin's algebraic fit; Gauss-Newton refines it.
/// Algebraic fits alone are biased to small radii for short noisy arcs.
///
/// @param points  at least three, in any unit
/// @return        std::nullopt for fewer than three points, and for points on one line, at one
///                position or not finite
///
/// Source: Taubin 1991; Newton form of Chernov, "Circular and Linear Regression", 2010.
std::optional<CircleFit> fit_circle(std::span<const Eigen::Vector2d> points);

}  // namespace vlp
