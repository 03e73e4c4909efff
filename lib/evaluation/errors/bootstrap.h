// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace vlp {

/// A 95 % confidence interval.
struct Interval {
  double low, high;
};

struct ErrorIntervals {
  Interval mean, median;
  /// Nothing of fewer than kFewestUnitsOfP90.
  std::optional<Interval> p90;
  Interval rms;
  /// That were drawn from.
  std::size_t units;
};

/// Fewer units tell too little to say how far to trust a figure.
inline constexpr std::size_t kFewestUnits = 5;
/// ... and fewer than these too little of the tenth that is worst: see error_intervals().
inline constexpr std::size_t kFewestUnitsOfP90 = 20;

/// Confidence intervals of the figures of `errors` (see ErrorFigures) by the percentile bootstrap
/// (Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, chapter 13) with 2,000 draws.
/// What is drawn, with replacement, is units, each with all of its errors: those of one unit go
/// together (captures at one station share its bias), and drawing them singly would make the
/// intervals too narrow. `units` numbers the unit of each error, from 0, without large gaps.
///
/// More than 1,000 units are dealt out at random to 1,000 parts of as many, and the parts are
/// drawn: the intervals are as wide on average, and steady to 1 / sqrt(2,000) of their width. Every
/// draw's quantiles are exact: a draw sums its weights at 256 ranks of the sorted errors, kept by
/// part, and walks from the last one below, so that n errors cost n log n once and n / 256 a draw.
///
/// Percentile intervals of few units are too narrow. Of 5 / 10 / 20 / 50 / 100 units with a
/// horizontal error each, that of the mean held the truth in 85 / 90 / 93 / 94 / 95 % of 2,000
/// cases, that of p90 in 40 / 64 / 87 / 88 / 94 %. So there is none of p90 for fewer than
/// kFewestUnitsOfP90, and nothing for fewer than kFewestUnits. Seeded: the same errors give the
/// same intervals, whatever the threads.
std::optional<ErrorIntervals> error_intervals(std::span<const double> errors,
                                              std::span<const std::size_t> units, int threads);

}  // namespace vlp
