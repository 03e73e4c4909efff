// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "station/records.h"

namespace vlp {

/// An individuals chart (Shewhart; ISO 7870-2): the limits are mean -+ 2.66 times the mean moving
/// range, the mean distance of each value from the one before. 2.66 = 3 / d2, d2 = 1.128 for ranges
/// of two. A value outside has a cause of its own; so have eight in a row on one side of the mean:
/// the station drifts. A value at the mean is on neither side.
struct ControlChart {
  double mean = 0, lower = 0, upper = 0;
  /// Indices of the values outside, and of the last of each eight or more in a row on one side.
  std::vector<std::size_t> outside, drifting;
};

/// Two values or more are needed for limits; otherwise they are the mean.
ControlChart control_chart(std::span<const double> values);

/// Draws values in their order with mean and limits, .png or .svg. Throws InputError, see draw().
void draw_trend(const std::filesystem::path& picture, const std::string& title,
                std::span<const TrendPoint> points);

}  // namespace vlp
