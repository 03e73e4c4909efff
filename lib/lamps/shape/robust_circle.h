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

struct RobustCircle {
  Circle circle;
  /// Of the centre, from the scatter of the points that belong to the circle.
  Matrix2 center_covariance;
  /// Which points belong to it, and how many.
  std::vector<bool> inliers;
  int count;
  /// Root of the mean squared distance of those.
  double rms;
};

/// The circle that most of the points support: the best of many through three points each (RANSAC,
/// Fischler and Bolles 1981, with a fixed choice of triples), then Gauss-Newton with Tukey's
/// biweight on the distance to the circle. `tolerance` is how far a point of the circle may lie off
/// it at the least, in the unit of the points. Nothing for fewer than five points or without five
/// that agree.
std::optional<RobustCircle> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                              std::span<const double> weights, double tolerance);

}  // namespace vlp
