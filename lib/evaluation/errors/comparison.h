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

/// Of fewer units a difference says nothing: percentile intervals are too narrow then, and "better"
/// or "worse" would be wrong, where there is no difference, in 17 / 11 / 9 / 8 / 6 % of 2,000 cases
/// of 5 / 8 / 10 / 20 / 50 units with a horizontal error each, not in 5 %.
inline constexpr std::size_t kFewestUnitsCompared = 20;

/// The smallest change of a mean error that matters: nobody measures less, nor gains by it. So
/// much, and such a share of the others' mean error, whichever is larger.
inline constexpr double kLeastDifference_m = 1e-6;
inline constexpr double kLeastDifferenceShare = 0.01;

/// These fixes and others of the same captures, by their horizontal errors.
struct Comparison {
  /// Captures with a fix in both, in the first alone, in the second alone.
  std::size_t pairs = 0, only_these = 0, only_others = 0;
  /// Pairs in which the first error is smaller, or larger.
  std::size_t smaller = 0, larger = 0;
  /// That the pairs are of (FixError::unit).
  std::size_t units = 0;
  /// Mean of (first error - second error), and its interval (error_intervals() of the differences,
  /// drawn by the units of the first).
  double mean_difference_m = 0;
  std::optional<Interval> interval_m;
  /// The smallest difference that matters here.
  double least_m = kLeastDifference_m;

  bool too_few() const { return units < kFewestUnitsCompared; }
  /// The words: "better" when the whole interval is below -least_m, "worse" when it is above
  /// least_m, "the same" when it is between, otherwise, and always when there are too few units,
  /// "no evidence". They are of the pairs alone: look at what is missing, too.
  std::string_view verdict() const;
  /// For example "worse by more than 0.004 mm", with least_m where the verdict rests on it.
  std::string words() const;
};

/// Pairs by image. `others` are against the same truth or path. No figures when there is no pair.
Comparison compare(const std::vector<FixRow>& fixes, const std::vector<FixError>& errors,
                   const std::vector<FixRow>& other_fixes,
                   const std::vector<FixError>& other_errors, int threads);

/// Throws InputError when the two files do not have rows of the same images: how many they are, and
/// where the first stands.
void check_same_images(const FromFile<FixRow>& fixes, const FromFile<FixRow>& others);

}  // namespace vlp
