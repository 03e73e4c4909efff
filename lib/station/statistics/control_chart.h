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

/// Individuals chart (Shewhart; ISO 7870-2). sigma is the mean moving range, the mean distance
/// between successive values, divided by 1.128 (d2 of ranges of two). The limits are mean -+ 3
/// sigma.
struct ControlChart {
  double mean = 0, sigma = 0, lower = 0, upper = 0;
};

/// Computes mean, sigma and limits of an individuals chart (ControlChart) of `values`, in
/// chronological order. Sigma is 0 for fewer than two values, so that the limits equal the mean.
ControlChart make_control_chart(std::span<const double> values);

/// Pattern that is improbable for values with random variation only. It refers to a value and its
/// predecessors, as distances from the mean in units of sigma. A value at the mean is on neither
/// side.
struct ChartRule {
  /// Name: "western-electric-1" to -4 (Statistical Quality Control Handbook, 1956), "nelson-1" to
  /// -8 (Nelson 1984, J. Quality Technology 16, 237-239).
  const char* name;
  const char* description;
  /// Returns true if the pattern ends at the last value.
  bool (*matches)(std::span<const double> sigmas);
};
std::span<const ChartRule> list_chart_rules();

/// Exponentially weighted moving average (NIST/SEMATECH e-Handbook 6.3.2.4):
///
///   z_i = w x_i + (1 - w) z_{i-1},   z_0 = target,
///   limits = target -+ width sigma sqrt(w / (2 - w)).
struct Ewma {
  double lower = 0, upper = 0;
  std::vector<double> averages;
};
Ewma compute_ewma(std::span<const double> values, double target, double sigma, double weight,
                  double width = 3);

/// Alarm of a control chart. `index` is the value at which the pattern of the rule ends.
struct ChartAlarm {
  std::string rule, description;
  std::size_t index;
};

/// Finds alarms, in the order of the values, by rules of these names. "western-electric" and
/// "nelson" select all of their rules, "ewma" the moving average with weight 0.3. Equal values have
/// no alarms. Throws std::invalid_argument for an unknown name.
std::vector<ChartAlarm> list_chart_alarms(std::span<const double> values,
                                          const std::vector<std::string>& rules);

/// Returns the alarms at the last `window` of `count` values. Earlier alarms were reported before,
/// and a long history of a good process always has some: without a change the Western Electric
/// rules have an alarm after 91 normal values on average (average run length), 65 values with a
/// Rayleigh distribution (lengths of 2-D errors), and 46 half-normal ones (absolute values).
std::vector<ChartAlarm> keep_recent_alarms(std::vector<ChartAlarm> alarms, std::size_t count,
                                           std::size_t window);

/// Plots values in their order with mean, limits, alarms and the gate, if any, as .png or .svg.
/// Throws InputError as write_plot().
void write_trend_plot(const std::filesystem::path& file, const std::string& title,
                      std::span<const TrendPoint> points, std::span<const ChartAlarm> alarms,
                      std::optional<double> gate);

}  // namespace vlp
