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

/// Result of fit_robust_circle().
struct RobustCircle {
  Circle circle;
  /// Covariance of the center, from the scatter of the points on the circle.
  Matrix2 center_covariance;
  /// Inliers, by the index of the point, and their number.
  std::vector<bool> inliers;
  int count;
  /// RMS distance of the inliers from the circle.
  double rms;
};

/// Fits the circle that most of the points support. Selects the best of many circles through three
/// points each (RANSAC, Fischler and Bolles 1981, with a fixed choice of triples). Then applies
/// Gauss-Newton with Tukey's biweight to the distances from the circle. `tolerance` is the smallest
/// distance of an outlier, in the unit of the points. Returns std::nullopt for fewer than five
/// points, or if less than five agree.
std::optional<RobustCircle> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                              std::span<const double> weights, double tolerance);

}  // namespace vlp
