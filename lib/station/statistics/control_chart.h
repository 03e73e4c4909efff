// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "station/records/records.h"

namespace vlp {

/// An individuals chart (Shewhart; ISO 7870-2): sigma is the mean moving range, the mean distance
/// of each value from the one before, / 1.128 (d2 of ranges of two); the limits are mean -+ 3
/// sigma.
struct ControlChart {
  double mean = 0, sigma = 0, lower = 0, upper = 0;
};

/// Two values or more are needed for limits; otherwise they are the mean.
ControlChart control_chart(std::span<const double> values);

/// What no chance, or hardly any, makes of values that only scatter. It is of a value and those
/// before it, as distances from the mean in sigmas; a value at the mean is on neither side.
struct ChartRule {
  /// "western-electric-1" to -4 (Statistical Quality Control Handbook, 1956), "nelson-1" to -8
  /// (Nelson 1984, J. Quality Technology 16, 237-239).
  const char* name;
  const char* meaning;
  /// Whether it holds of the last of them.
  bool (*holds)(std::span<const double> sigmas);
};
std::span<const ChartRule> chart_rules();

/// The exponentially weighted moving average, from the target on: z_i = w x_i + (1 - w) z_{i-1},
/// z_0 the target; its limits are target -+ width sigma sqrt(w / (2 - w)) (NIST/SEMATECH
/// e-Handbook 6.3.2.4).
struct Ewma {
  double lower = 0, upper = 0;
  std::vector<double> averages;
};
Ewma ewma(std::span<const double> values, double target, double sigma, double weight,
          double width = 3);

/// A value that ends a pattern.
struct ChartAlarm {
  std::string rule, meaning;
  std::size_t index;
};

/// Alarms in the order of the values, by rules of these names; "western-electric" and "nelson" are
/// all of them, "ewma" is the average with weight 0.3. Values that are all equal have none. Throws
/// std::invalid_argument for another name.
std::vector<ChartAlarm> chart_alarms(std::span<const double> values,
                                     const std::vector<std::string>& rules);

/// Draws values in their order with mean and limits, a gate if there is one, and the alarms; .png
/// or .svg. Throws InputError, see draw().
void draw_trend(const std::filesystem::path& picture, const std::string& title,
                std::span<const TrendPoint> points, std::span<const ChartAlarm> alarms,
                std::optional<double> gate);

}  // namespace vlp
