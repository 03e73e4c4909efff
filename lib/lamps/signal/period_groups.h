// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "lamps/signal/row_time.h"

namespace vlp {

/// Lights that have one period, and so, it seems, are of one lamp.
struct PeriodGroup {
  /// Median of log period_lines, and its standard deviation.
  double log_period;
  double sd;
  int lights;
  std::optional<int> lamp;
};

/// Lights with a label by their lamp, the others by where their periods are dense: within 1.5 % of
/// the period that most are near. Groups of less than a tenth of the largest's lights, or of one
/// in fifty, are left out: they are lights that something hides in part.
std::vector<PeriodGroup> period_groups(std::span<const MeasuredPeriod> lights);

}  // namespace vlp
