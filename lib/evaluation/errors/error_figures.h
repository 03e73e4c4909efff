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
struct ErrorFigures {
  std::size_t count;
  double mean, median, p90, max, rms;
};

/// Returns the smallest of the sorted values that the given fraction of all does not exceed.
/// @pre not empty, 0 < fraction <= 1
double quantile(std::span<const double> sorted, double share);

/// Computes the statistics of errors without sign.
/// @pre not empty
ErrorFigures figures_of(std::vector<double> errors);

/// Statistics of errors with a sign, such as heights: their mean, and the statistics of their
/// absolute values.
struct SignedFigures {
  double bias;
  ErrorFigures sizes;
};
SignedFigures signed_figures_of(std::vector<double> errors);

/// Returns the cumulative distribution as pairs of fraction and quantile, at 1 %, 2 %, ..., 100 %.
/// @pre not empty
std::vector<std::pair<double, double>> distribution_of(std::vector<double> errors);

}  // namespace vlp
