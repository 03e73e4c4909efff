// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "lamps/signal/period_groups.h"
#include "rig/lamp_map.h"

namespace vlp {

/// What a row time makes of groups of lights: of each the residual to its lamp, if it has one, in
/// log period; and their cost, see row_time.h.
struct PeriodMatch {
  double log_row_time;
  double cost;
  std::vector<std::optional<double>> residuals;
};

/// Matches groups of lights with the lamps of a map that have a frequency.
class PeriodMatching {
 public:
  PeriodMatching(std::vector<PeriodGroup> groups, const LampMap& lamps);

  /// Of every row time that puts a lamp's frequency to a group's period, each refined.
  std::vector<PeriodMatch> matches() const;

 private:
  PeriodMatch refined(double log_row_time) const;
  PeriodMatch matched(double log_row_time) const;
  std::optional<double> nearest_frequency(const PeriodGroup& group, double log_row_time) const;

  std::vector<PeriodGroup> groups_;
  std::vector<double> log_frequencies_;  // different ones, in order
  std::map<int, double> log_frequency_;  // by lamp
};

}  // namespace vlp
