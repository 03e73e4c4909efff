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
  /// Inverse of the normal equations, and the variance of a point of weight 1 from the scatter of
  /// the points on the curve.
  Eigen::Matrix<double, N, N> inverse;
  double variance;
  /// True for each point that is an inlier, by its index, and number of inliers.
  std::vector<bool> inliers;
  int count;
  /// Sum of the weights, including those of the biweight.
  double sum_of_weights;

  /// Returns the covariance of the parameters. The variance of a point is at least `min_variance`.
  Eigen::Matrix<double, N, N> parameter_covariance(double min_variance = 0) const {
    return std::max(variance, min_variance) * inverse;
  }
};

/// Computes a Gauss-Newton step from `distance(i)`, the CurveDistance of point i, for
/// weights.size() points. The scale is the median distance of the points closer than four
/// tolerances, and at least a tenth of the tolerance. Returns std::nullopt if less than N + 2
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

  MEstimateStep<N> result{{}, {}, 0, std::vector<bool>(weights.size()), 0, 0};
  Normal<std::size_t(N)> normal;
  double all = 0, psi_squares = 0, slopes = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto& [error, slope] = distances[i];
    const double relative_error = error / cut;
    result.inliers[i] = std::abs(relative_error) < 1;
    if (!result.inliers[i]) continue;
    const double inside = 1 - relative_error * relative_error;
    const double weight = weights[i] * inside * inside;
    all += weights[i];
    psi_squares += weights[i] * std::pow(inside * inside * error, 2);
    slopes += weights[i] * inside * (1 - 5 * relative_error * relative_error);
    normal.add_residual_row(slope, error, weight);
    result.sum_of_weights += weight;
    ++result.count;
  }
  if (result.count < min_points || !(slopes > 0)) return std::nullopt;
  const Cholesky<std::size_t(N)> factor(normal);
  if (!factor.has_full_rank(1e-12)) return std::nullopt;
  const auto step = factor.solve_normal_equations(normal.gradient);
  std::copy(step.begin(), step.end(), result.step.begin());
  // Variance of an M-estimate: the mean of psi^2 over the squared mean of its slope.
  result.variance =
      psi_squares * all / (slopes * slopes) * result.sum_of_weights / (result.count - N);
  for (int i = 0; i < N; ++i) {
    const auto column = factor.compute_inverse_column(std::size_t(i));
    std::copy(column.begin(), column.end(), result.inverse.col(i).begin());
  }
  return result;
}

}  // namespace vlp
