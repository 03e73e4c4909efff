// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace vlp {

/// What errors amount to, in their unit. Quantiles are the smallest error that such a share of all
/// does not exceed: always one that is there, never one in between.
struct ErrorFigures {
  std::size_t count;
  double mean, median, p90, max, rms;
};

/// The smallest of the sorted values that `share` of all do not exceed. Preconditions: not empty,
/// 0 < share <= 1.
double quantile(std::span<const double> sorted, double share);

/// Of errors without sign. Precondition: not empty.
ErrorFigures figures_of(std::vector<double> errors);

/// Errors with a sign, such as those of heights: their mean, and the figures of their sizes.
struct SignedFigures {
  double bias;
  ErrorFigures sizes;
};
SignedFigures signed_figures_of(std::vector<double> errors);

/// The distribution function: shares, and the quantiles there. At 1 %, 2 %, ..., 100 %.
std::vector<std::pair<double, double>> distribution_of(std::vector<double> errors);

}  // namespace vlp
