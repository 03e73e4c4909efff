// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace vlp {

/// Light with a measured stripe period.
struct MeasuredPeriod {
  double period_lines;
  /// Lamp of the light, if a table labels it.
  std::optional<int> lamp;
  /// Lit fraction of a period, if it was measured.
  std::optional<double> duty = {};
};

/// Lights with the same period, which are assumed to be one lamp.
struct PeriodGroup {
  /// Median of log period_lines, and its standard deviation.
  double log_period;
  double sd;
  /// Indices of the lights of the group.
  std::vector<std::size_t> lights;
  std::optional<int> lamp;
  /// Median of the measured duties; std::nullopt if there is none.
  std::optional<double> duty;
};

/// Groups lights with a label by their lamp. Groups the others by density of their periods: within
/// 1.5 % of the period with most neighbors. Discards groups with less than a tenth of the lights of
/// the largest group, or with less than one in fifty of these lights, because they are partly
/// hidden lights.
std::vector<PeriodGroup> group_periods(std::span<const MeasuredPeriod> lights);

}  // namespace vlp
