// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "floor_limits.h"

namespace vlp {

/// Standard deviations of a fix: horizontal is the root of the sum of the variances of x and y.
/// Variances below zero, which rounding makes of none, are none.
struct FixSpread {
  double horizontal_m;
  double height_m;
  double yaw_rad;
};

FixSpread spread_of(const Matrix4& covariance);

/// The error budget of a floor: for each source alone, and for all together, the median and the
/// worst over the places that see two lamps or more, each figure on its own.
struct FloorSummary {
  struct Row {
    /// As in FloorLimits.
    FloorLimits::Source source;
    FixSpread median;
    FixSpread worst;
    /// Of the horizontal variances, summed over these places, what is this source's.
    double share;
  };
  /// In the order of the sources.
  std::vector<Row> sources;
  Row together;
  std::size_t places_with_fix;

  /// The one with the largest share, which is to be improved first.
  const Row& largest() const;
};

/// Nothing when no place has a fix.
std::optional<FloorSummary> summarize(const FloorLimits& limits);

}  // namespace vlp
