// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "floor_limits.h"

namespace vlp {

/// Standard deviations of a fix: horizontal is the root of the sum of the variances of x and y.
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
    std::string_view source;
    FixSpread median;
    FixSpread worst;
  };
  /// noise, centre, tilt, lamp map, together.
  std::array<Row, 5> rows;
  std::size_t places_with_fix;
};

/// Nothing when no place has a fix.
std::optional<FloorSummary> summarize(std::span<const FloorLimit> limits);

}  // namespace vlp
