// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "geometry/normal_equations.h"

namespace vlp {

/// Signed distance of a point from a curve, and its derivative with respect to the N parameters of
/// the curve.
template <int N>
struct CurveDistance {
  double error;
  Eigen::Matrix<double, N, 1> slope;
};

/// Result of one Gauss-Newton step that fits a curve with N parameters to points. The loss of the
/// distances is Tukey's biweight (Huber 1981).
template <int N>
struct MEstimateStep {
  /// Step to subtract from the parameters.
  Eigen::Matrix<double, N, 1> step;
  /// True for each point that is an inlier, by its index.
  std::vector<bool> inliers;
};

/// Computes a Gauss-Newton step from `distance(i)`, the CurveDistance of point i, for
/// weights.size() points. The scale is the median distance of the points closer than four
/// tolerances, and at least a tenth of the tolerance. Returns std::nullopt if fewer than N + 2
/// points remain, or if they do not determine the curve.
template <int N, typename Distance>
std::optional<MEstimateStep<N>> compute_m_estimate_step(std::span<const double> weights,
                                                        double tolerance,
                                                        const Distance& distance) {
  constexpr int min_points = N + 2;
  std::vector<CurveDistance<N>> distances;
  std::vector<double> sizes;
  distances.reserve(weights.size());
  sizes.reserve(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    distances.push_back(distance(i));
    const double size = std::abs(distances[i].error);
    if (size < 4 * tolerance) sizes.push_back(size);
  }
  if (sizes.size() < min_points) return std::nullopt;
  constexpr double sigma_from_median = 1.4826, tukey = 4.685;
  const double median = upper_median(std::move(sizes));
  const double cut =
      std::min(4 * tolerance, tukey * std::max(sigma_from_median * median, tolerance / 10));

  MEstimateStep<N> result{{}, std::vector<bool>(weights.size())};
  Normal<std::size_t(N)> normal;
  int count = 0;
  double slopes = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto& [error, slope] = distances[i];
    const double relative_error = error / cut;
    result.inliers[i] = std::abs(relative_error) < 1;
    if (!result.inliers[i]) continue;
    const double inside = 1 - relative_error * relative_error;
    slopes += weights[i] * inside * (1 - 5 * relative_error * relative_error);
    normal.add_residual_row(slope, error, weights[i] * inside * inside);
    ++count;
  }
  if (count < min_points || !(slopes > 0)) return std::nullopt;
  const Cholesky<std::size_t(N)> factor(normal);
  if (!factor.has_full_rank(1e-12)) return std::nullopt;
  const auto step = factor.solve_normal_equations(normal.gradient);
  std::copy(step.begin(), step.end(), result.step.begin());
  return result;
}

}  // namespace vlp
