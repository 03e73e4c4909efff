// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "evaluation/errors/bootstrap.h"
#include "evaluation/errors/fix_errors.h"

namespace vlp {

/// Minimum number of clusters for a verdict other than "inconclusive": a difference at fewer points
/// may not hold for the floor. Without any difference, "better" or "worse" results in 6 % of 2,000
/// cases with 20 or 50 clusters and one horizontal error each; 5 % would be nominal.
inline constexpr std::size_t kMinClustersCompared = 20;

/// Relevant change of a mean error, as a fraction of the mean error of the other fixes; a smaller
/// change is neither measurable nor useful (ComparedQuantity::min_difference).
inline constexpr double kMinDifferenceFraction = 0.01;

/// Quantity by which two sets of fixes are compared: a nonnegative number for each fix.
struct ComparedQuantity {
  const char* name;
  /// Key in evaluation.json, and metric whose gate limits its increase.
  const char *key, *metric;
  /// Unit of messages and of the metric, and the number of these units in an SI unit.
  const char* unit;
  double units_per_si;
  /// Smallest relevant change of the mean, in SI units.
  double min_difference;
  /// Mean of correct fixes, below which an increase is no loss; 0 for errors.
  double correct_mean;
  /// Returns the quantity of a fix; std::nullopt if it is unknown.
  std::optional<double> (*compute)(const FixRow& fix, const FixError& error);
};

/// Returns horizontal error, height error, yaw error, horizontal standard deviation, and the RMS of
/// error / standard deviation over x, y, z and yaw.
std::span<const ComparedQuantity, 5> list_compared_quantities();

/// Comparison of one quantity over the captures that have it in both sets of fixes, in SI units.
struct QuantityComparison {
  /// Number of captures, of those with a smaller and with a larger first value, and of their
  /// clusters (FixError::cluster).
  std::size_t pairs = 0, smaller = 0, larger = 0, clusters = 0;
  /// Mean of (first value - second value) and its confidence interval (bootstrap_intervals()
  /// of the differences, resampled by the clusters of the first).
  double mean_difference = 0;
  std::optional<Interval> interval;
  /// Smallest relevant difference of the means.
  double min_relevant = 0;

  bool has_too_few_clusters() const { return clusters < kMinClustersCompared; }
  /// Returns the verdict on the pairs, which ignores missing fixes:
  ///   "better"       the whole interval is below -min_relevant
  ///   "worse"        the whole interval is above min_relevant
  ///   "equivalent"   the whole interval is in between
  ///   "inconclusive" otherwise, and always if there are too few clusters
  std::string_view comparison_verdict() const;
  /// Returns the lower end of the interval, negative if the fixes may be better. Returns 0 for too
  /// few clusters, and for a positive difference too small to matter.
  double compute_loss() const;
  /// Returns, for example, "worse by more than 0.004 mm", with min_relevant if the verdict depends
  /// on it.
  std::string describe_result(const ComparedQuantity& quantity) const;
};

/// Comparison of two sets of fixes of the same captures.
struct Comparison {
  /// Number of captures with a fix in both, in the first only, in the second only.
  std::size_t pairs = 0, only_in_fixes = 0, only_in_other_fixes = 0;
  /// Number of captures that escape the comparison: with a fix in the second only, with a quantity
  /// in one of both only, or without a row in the second.
  std::size_t unpaired = 0;
  /// Comparisons in the order of list_compared_quantities(); without pairs if a quantity is
  /// unknown.
  std::array<QuantityComparison, 5> quantities{};

  const QuantityComparison& horizontal() const { return quantities.front(); }
  /// Returns "worse" if any quantity is worse; otherwise the first of "better", "inconclusive" and
  /// "equivalent" that applies to any quantity.
  std::string_view comparison_verdict() const;
};

/// Compares fixes, paired by image. `other_errors` are against the same ground truth or path.
/// Without pairs the statistics keep their defaults.
Comparison compare_fix_errors(const std::vector<FixRow>& fixes, const std::vector<FixError>& errors,
                              const std::vector<FixRow>& other_fixes,
                              const std::vector<FixError>& other_errors, int threads);

}  // namespace vlp
