// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace vlp {

/// Light whose stripe period was measured.
struct MeasuredPeriod {
  double period_lines;
  /// Lamp of the light, if a table states it.
  std::optional<int> lamp;
  /// Lit fraction of a period, if it was measured.
  std::optional<double> duty = {};
};

/// Lights with one period, which are taken for one lamp.
struct PeriodGroup {
  /// Median of log period_lines, and its standard deviation.
  double log_period;
  double sd;
  /// Indices of the lights that were grouped.
  std::vector<std::size_t> lights;
  std::optional<int> lamp;
  /// Median of the measured duties; std::nullopt if there is none.
  std::optional<double> duty;
};

/// Groups lights with a label by their lamp, the others by where their periods are dense: within
/// 1.5 % of the period that most are near. Groups with less than a tenth of the lights of the
/// largest, or with less than one in fifty, are left out: they are lights that something hides in
/// part.
std::vector<PeriodGroup> period_groups(std::span<const MeasuredPeriod> lights);

}  // namespace vlp
