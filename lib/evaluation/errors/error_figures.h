// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace vlp {

/// Statistics of errors, in their unit. A quantile is the smallest error that the given fraction of
/// all errors does not exceed. It is an element of the data, never interpolated.
struct ErrorStatistics {
  std::size_t count;
  double mean, median, p90, max, rms;
};

/// Returns the smallest of the sorted values that the given fraction of all does not exceed.
/// @pre not empty, 0 < fraction <= 1
double quantile(std::span<const double> sorted, double fraction);

/// Computes the statistics of errors without sign.
/// @pre not empty
ErrorStatistics compute_error_statistics(std::vector<double> errors);

/// Statistics of errors with a sign, such as heights: their mean, and the statistics of their
/// absolute values.
struct SignedErrorStatistics {
  double bias;
  ErrorStatistics sizes;
};
SignedErrorStatistics compute_signed_error_statistics(std::vector<double> errors);

/// Returns the cumulative distribution as pairs of fraction and quantile, at 1 %, 2 %, ..., 100 %.
/// @pre not empty
std::vector<std::pair<double, double>> compute_distribution(std::vector<double> errors);

}  // namespace vlp
