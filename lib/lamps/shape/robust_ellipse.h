// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/types.h"

namespace vlp {

struct RobustEllipse {
  Eigen::Vector2d center;
  /// The points of the ellipse are center + rim_from_circle * (cos a, sin a). Symmetric.
  Matrix2 rim_from_circle;
  /// Of the centre, from the scatter of the points that belong to the ellipse.
  Matrix2 center_covariance;
  /// Which points belong to it, and how many.
  std::vector<bool> inliers;
  int count;
};

/// The ellipse close to a circle that most of the points support: the circle of fit_robust_circle()
/// with a tolerance of an eighth of its size, then Gauss-Newton with Tukey's biweight on the
/// distance q from the ellipse (x - c)^T M (x - c) = 1 (to first order, Sampson 1982):
/// q = (s - 1) s / |M (x - c)|, s^2 = (x - c)^T M (x - c).
/// `tolerance` is how far a point of the ellipse may lie off it at the least, in the unit of the
/// points. Nothing for fewer than seven points that agree, or axes that differ by more than three
/// times.
std::optional<RobustEllipse> fit_robust_ellipse(std::span<const Eigen::Vector2d> points,
                                                std::span<const double> weights, double tolerance);

/// The same of one that may be as slender as it likes, if most of it is seen: after the points are
/// scaled along the axes of their scatter, which makes it nearly a circle.
std::optional<RobustEllipse> fit_slender_ellipse(std::span<const Eigen::Vector2d> points,
                                                 std::span<const double> weights, double tolerance);

}  // namespace vlp
