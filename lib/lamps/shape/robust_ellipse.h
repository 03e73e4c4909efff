// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/circle_fit.h"
#include "geometry/types.h"

namespace vlp {

/// Circle or ellipse that fits most of the points, in their unit.
struct RobustEllipse {
  Eigen::Vector2d center;
  /// Symmetric 2x2 matrix of the ellipse, in the unit of the points: a point of the ellipse is
  /// center + rim_from_circle * (cos a, sin a). For a circle it is the radius times the identity.
  Matrix2 rim_from_circle;
  /// Covariance of the center, from the scatter of the inliers.
  Matrix2 center_covariance;
  /// True for each point that is an inlier, by its index, and number of inliers.
  std::vector<bool> inliers;
  int count;

  /// Returns the circle. @pre The fit is that of fit_robust_circle().
  Circle to_circle() const { return {center, rim_from_circle(0, 0)}; }
};

/// Returns the diagonal of the bounding box of the points; 0 if there are none.
double compute_bounding_box_diagonal(std::span<const Eigen::Vector2d> points);

/// Fits the circle that most of the points support. Selects the best of many circles through three
/// points each (RANSAC, Fischler and Bolles 1981, with a fixed choice of triples). Then applies
/// Gauss-Newton with Tukey's biweight to the distances from the circle. `tolerance` is the smallest
/// distance of an outlier, in the unit of the points. Returns std::nullopt for fewer than five
/// points, or if less than five agree.
std::optional<RobustEllipse> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                               std::span<const double> weights, double tolerance);

/// Fits the nearly circular ellipse that most of the points support. Starts from the circle of
/// fit_robust_circle() with a tolerance of an eighth of its size. Then applies Gauss-Newton with
/// Tukey's biweight to the distance q from the ellipse (x - c)^T M (x - c) = 1. To first order
/// (Sampson 1982) it is
///
///     q = (s - 1) s / |M (x - c)|,   s^2 = (x - c)^T M (x - c).
///
/// `tolerance` is the smallest distance of an outlier, in the unit of the points. Returns
/// std::nullopt if fewer than seven points agree, or if the ratio of the axes exceeds three.
std::optional<RobustEllipse> fit_robust_ellipse(std::span<const Eigen::Vector2d> points,
                                                std::span<const double> weights, double tolerance);

/// Fits an ellipse of any axis ratio if most of it is visible. The points are first scaled along
/// the principal axes of their scatter, so that they are nearly on a circle.
std::optional<RobustEllipse> fit_elongated_ellipse(std::span<const Eigen::Vector2d> points,
                                                   std::span<const double> weights,
                                                   double tolerance);

}  // namespace vlp
