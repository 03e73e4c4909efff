// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "floor_limits.h"

namespace vlp {

/// Standard deviations of a fix. `horizontal_m` is the root of the sum of the variances of x and y.
/// Negative variances, which result from rounding, count as zero.
struct FixSds {
  double horizontal_m;
  double height_m;
  double yaw_rad;
};

/// Returns the standard deviations of a covariance of (X, Y, Z, yaw).
FixSds compute_fix_sds(const Matrix4& covariance);

/// Summary of the error budget of a floor: median and maximum for each source alone and for all
/// sources together. Taken over the positions where at least two lamps are visible, for each
/// statistic separately.
struct FloorSummary {
  struct Row {
    /// As in FloorLimits.
    FloorLimits::Source source;
    FixSds median;
    FixSds worst;
    /// Fraction of the sum of the horizontal variances that is due to this source.
    double fraction;
  };
  /// In the order of the sources.
  std::vector<Row> sources;
  Row together;
  std::size_t places_with_fix;

  /// Returns the source with the largest fraction, which has the greatest potential for
  /// improvement.
  const Row& largest() const;
};

/// Computes the summary. Returns std::nullopt if no position has a fix.
std::optional<FloorSummary> summarize(const FloorLimits& limits);

}  // namespace vlp
