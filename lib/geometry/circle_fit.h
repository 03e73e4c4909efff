// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "types.h"

namespace vlp {

struct Circle {
  Eigen::Vector2d center;
  double radius;
};

struct CircleFit {
  Circle circle;
  /// Root of the mean squared distance of the points from the circle.
  double rms;
  /// Of the centre, for the scatter found: s^2 (J^T J)^-1 with s^2 = sum of squares / (n - 3).
  /// Infinite for three points, which leave no scatter to measure. Symmetric 2x2.
  Matrix2 center_covariance;
  bool converged;
};

/// The circle with the least sum of squared distances of the points from it (the geometric
/// fit): Taubin's algebraic fit (Taubin 1991; Newton form of Chernov, "Circular and Linear
/// Regression", 2010), then Gauss-Newton. Algebraic fits alone shrink short noisy arcs. Any
/// units. Needs three points or more; nothing for fewer and for points on one line or spot.
std::optional<CircleFit> fit_circle(std::span<const Eigen::Vector2d> points);

}  // namespace vlp
