// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/types.h"

namespace vlp {

/// Result of fit_robust_ellipse() and fit_slender_ellipse().
struct RobustEllipse {
  Eigen::Vector2d center;
  /// Points of the ellipse: center + rim_from_circle * (cos a, sin a). Symmetric.
  Matrix2 rim_from_circle;
  /// Covariance of the center, from the scatter of the points on the ellipse.
  Matrix2 center_covariance;
  /// Inliers, by the index of the point, and their number.
  std::vector<bool> inliers;
  int count;
};

/// Fits the nearly circular ellipse that most of the points support. Starts from the circle of
/// fit_robust_circle() with a tolerance of an eighth of its size. Then applies Gauss-Newton with
/// Tukey's biweight to the distance q from the ellipse (x - c)^T M (x - c) = 1, to first order
/// (Sampson 1982):
///
///     q = (s - 1) s / |M (x - c)|,   s^2 = (x - c)^T M (x - c).
///
/// `tolerance` is the smallest distance of an outlier, in the unit of the points. Returns
/// std::nullopt if fewer than seven points agree, or if the ratio of the axes exceeds three.
std::optional<RobustEllipse> fit_robust_ellipse(std::span<const Eigen::Vector2d> points,
                                                std::span<const double> weights, double tolerance);

/// Fits an ellipse of any axis ratio if most of it is visible. The points are first scaled along
/// the principal axes of their scatter, so that they are nearly on a circle.
std::optional<RobustEllipse> fit_slender_ellipse(std::span<const Eigen::Vector2d> points,
                                                 std::span<const double> weights, double tolerance);

}  // namespace vlp
