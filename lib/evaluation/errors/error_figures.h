// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "evaluation/errors/fix_errors.h"

namespace vlp {

/// Statistics of errors, in their unit. A quantile is the smallest error that the given fraction of
/// all errors does not exceed. It is an element of the data, never interpolated.
struct ErrorStatistics {
  std::size_t count;
  double mean, median, p90, max, rms;
};

/// Returns a quantile of sorted values: the smallest of them that at least the given fraction of
/// all values does not exceed. It is never interpolated.
/// @param sorted    values in ascending order, not empty
/// @param fraction  0 < fraction <= 1
double get_quantile(std::span<const double> sorted, double fraction);

/// Computes the statistics of errors without sign.
/// @pre not empty
ErrorStatistics summarize_errors(std::vector<double> errors);

/// Statistics of errors with a sign, such as heights: their mean, and the statistics of their
/// absolute values.
struct SignedErrorStatistics {
  double bias;
  ErrorStatistics magnitudes;
};
SignedErrorStatistics summarize_signed_errors(std::vector<double> errors);

/// Returns the percentiles of the errors, 1 % to 100 %, as pairs of fraction and quantile.
/// @pre not empty
std::vector<std::pair<double, double>> list_percentiles(std::vector<double> errors);

/// Bias and repeatability over the reference points with two fixes or more.
struct BiasAndRepeatability {
  /// Reference point and the statistics of its fixes.
  struct ReferencePoint {
    /// True position (x, y) of the reference point's first capture, in the world.
    Eigen::Vector2d xy_m;
    std::size_t fixes;
    /// Mean of the horizontal errors (x, y) at the reference point, in the world.
    Eigen::Vector2d bias_m;
    /// Horizontal standard deviation of x and y together, sqrt(sum |e - bias|^2 / (fixes - 1)).
    double sd_m;
  };
  /// Reference points with two fixes or more, in the order of the ground truth.
  std::vector<ReferencePoint> reference_points;
  std::size_t fixes;
  /// Repeatability within reference points, sqrt(sum |e - bias of its reference point|^2 / (fixes -
  /// stations)).
  double repeatability_m;
  /// RMS bias of the reference points, weighted by fixes and corrected for the scatter of the
  /// means: sqrt((sum |bias|^2 - stations scatter^2) / fixes), where the sum is over the fixes. Not
  /// below zero.
  double bias_m;
};

/// Computes bias and scatter from the errors of compare_with_truth(). Returns
/// std::nullopt if no reference point has two fixes.
std::optional<BiasAndRepeatability> compute_bias_and_repeatability(
    const std::vector<FixError>& errors, const std::vector<TruthRow>& truth);

}  // namespace vlp
