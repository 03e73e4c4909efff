// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace vlp {

/// 95 % confidence interval from `low` to `high`, in the unit of the statistic.
struct Interval {
  double low, high;
};

/// 95 % confidence intervals of the mean, median, 90th percentile and RMS of a set of errors, in
/// the unit of the errors.
struct ErrorIntervals {
  Interval mean, median;
  /// Interval of the 90th percentile; std::nullopt for fewer than kMinClustersForP90 clusters.
  std::optional<Interval> p90;
  Interval rms;
  /// Number of clusters that were resampled.
  std::size_t clusters;
};

/// Minimum number of clusters for intervals.
inline constexpr std::size_t kMinClusters = 5;
/// Minimum number of clusters for an interval of the 90th percentile, see
/// bootstrap_intervals().
inline constexpr std::size_t kMinClustersForP90 = 20;

/// Computes confidence intervals of error statistics (ErrorStatistics) by the bootstrap with 2,000
/// resamples: studentized for mean and mean square, percentiles for median and 90th percentile.
/// Source: Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, chapters 12 and 13.
///
/// The studentized interval of a mean m with standard deviation s is m - s t, where t are the
/// quantiles of (m* - m) / s* over the resamples. s and s* are those of the ratio of sums over
/// clusters. That of the rms is the square root of that of the mean square.
///
/// Clusters are resampled with replacement, each with all of its errors. Errors within a cluster
/// are correlated: captures at one reference point share its bias. Resampling single errors would
/// make the intervals too narrow. Returns std::nullopt for fewer than kMinClusters clusters.
///
/// @param errors  errors without sign, or differences
/// @param clusters  number of the cluster of each error, from 0, without large gaps
///
/// More than 1,000 clusters are distributed randomly to 1,000 groups of equal size, and the groups
/// are resampled. The intervals have the same width on average, with a relative standard deviation
/// of 1 / sqrt(2,000).
///
/// The quantiles of every resample are exact. A resample sums its weights at 256 ranks of the
/// sorted errors, from counts stored by group, and continues from the last rank below. The cost for
/// n errors is n log n once and n / 256 per resample.
///
/// Measured coverage in 2,000 cases with 5 / 10 / 20 / 50 / 100 clusters and one horizontal error
/// each (normal along both axes): mean 94 / 95 / 95 / 94 / 95 %, rms 92 / 93 / 94 / 94 / 95 %,
/// median 94 / 93 / 94 / 95 / 94 %. The percentiles of p90 are too narrow: - / - / 87 / 86 / 93 %.
/// With heavy tails (Student's t, 5 degrees of freedom) the rms has 88 / 90 / 92 % up to 20
/// clusters. The seeds are fixed: the same errors yield the same intervals for any number of
/// threads.
std::optional<ErrorIntervals> bootstrap_intervals(std::span<const double> errors,
                                                  std::span<const std::size_t> clusters,
                                                  int threads);

}  // namespace vlp
