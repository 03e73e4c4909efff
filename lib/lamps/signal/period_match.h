// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "lamps/signal/period_groups.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Assignment of period groups to the lamps of a map under one row time.
struct PeriodMatch {
  double log_row_time;
  /// Cost of the assignment, see estimate_row_time().
  double cost;
  /// Residual of each group in log period; std::nullopt if no lamp is assigned.
  std::vector<std::optional<double>> residuals;
  /// Possible lamps of each group: its label, or all lamps with its frequency.
  std::vector<std::vector<int>> lamps;
};

/// Matcher of period groups to the lamps of a map that have a frequency.
class PeriodMatching {
 public:
  PeriodMatching(std::vector<PeriodGroup> groups, const LampMap& lamps);

  /// Returns a refined match for every row time that maps the frequency of a lamp to the period of
  /// a group.
  std::vector<PeriodMatch> matches() const;

 private:
  using LampsByLogFrequency = std::map<double, std::vector<int>>;

  PeriodMatch refine_match(double log_row_time) const;
  PeriodMatch evaluate_match(double log_row_time) const;
  LampsByLogFrequency::const_iterator find_nearest_frequency(const PeriodGroup& group,
                                                             double log_row_time) const;
  /// Returns the cost of the group's duty if the group is one of these lamps.
  double compute_duty_cost(const PeriodGroup& group, const std::vector<int>& lamps) const;

  std::vector<PeriodGroup> groups_;
  LampsByLogFrequency lamps_;
  std::map<int, double> log_frequency_;  // by lamp
  std::map<int, double> duty_;           // by lamp; empty unless all have one
};

}  // namespace vlp
