// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "evaluation/errors/bootstrap.h"
#include "evaluation/errors/fix_errors.h"

namespace vlp {

/// Minimum number of clusters for a verdict other than "inconclusive", since percentile intervals
/// from few clusters are too narrow. Without any difference, "better" or "worse" would result in 17
/// / 11 / 9 / 8 / 6 % of 2,000 cases. The cases had 5 / 8 / 10 / 20 / 50 clusters with one
/// horizontal error each; 5 % would be nominal.
inline constexpr std::size_t kMinClustersCompared = 20;

/// Smallest relevant change of a mean horizontal error; a smaller change is neither measurable nor
/// useful. The larger one of two limits applies: this length, m, or this fraction of the mean error
/// of the other fixes.
inline constexpr double kMinDifference_m = 1e-6;
inline constexpr double kMinDifferenceFraction = 0.01;

/// Comparison of two sets of fixes of the same captures, by horizontal errors.
struct Comparison {
  /// Number of captures with a fix in both, in the first only, in the second only.
  std::size_t pairs = 0, only_in_fixes = 0, only_in_other_fixes = 0;
  /// Number of pairs in which the first error is smaller, and in which it is larger, than the
  /// second.
  std::size_t smaller = 0, larger = 0;
  /// Number of clusters (FixError::cluster) of the pairs.
  std::size_t clusters = 0;
  /// Mean of (first error - second error) and its confidence interval (bootstrap_error_intervals()
  /// of the differences, resampled by the clusters of the first).
  double mean_difference_m = 0;
  std::optional<Interval> interval_m;
  /// Smallest relevant difference of the mean errors in this comparison (kMinDifference_m).
  double min_relevant_m = kMinDifference_m;

  bool has_too_few_clusters() const { return clusters < kMinClustersCompared; }
  /// Returns the verdict on the pairs, which ignores missing fixes:
  ///   "better"       the whole interval is below -min_relevant_m
  ///   "worse"        the whole interval is above min_relevant_m
  ///   "equivalent"   the whole interval is in between
  ///   "inconclusive" otherwise, and always if there are too few clusters
  std::string_view comparison_verdict() const;
  /// Returns, for example, "worse by more than 0.004 mm", with min_relevant_m if the verdict
  /// depends on it.
  std::string describe_comparison_result() const;
};

/// Compares fixes, paired by image. `other_errors` are against the same ground truth or path.
/// Without pairs the statistics keep their defaults.
Comparison compare_horizontal_errors(const std::vector<FixRow>& fixes,
                                     const std::vector<FixError>& errors,
                                     const std::vector<FixRow>& other_fixes,
                                     const std::vector<FixError>& other_errors, int threads);

}  // namespace vlp
