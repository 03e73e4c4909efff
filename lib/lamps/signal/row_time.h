// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lamps/signal/period_groups.h"
#include "rig/lamp_map.h"

namespace vlp {

struct RowTime {
  double row_time_s;
  /// Standard deviation, from the scatter of the lamps about their frequencies, of the lights
  /// about their lamps, and half a thousandth, by which all measured periods may be off together.
  /// With one lamp only, the error of its frequency comes on top.
  double sd_s;
  /// Lamps that it rests on, and lights of them.
  int lamps, lights;
};

/// Row time that explains the measured periods, with the assignment of groups to lamps.
struct RowTimeCandidate {
  RowTime row_time;
  /// See estimate_row_time().
  double cost;
  /// Lamps that each group may be, by the index of the group: those with the frequency that it
  /// then has; empty if no lamp has it.
  std::vector<std::vector<int>> lamps;
};

struct RowTimeCandidates {
  std::vector<PeriodGroup> groups;
  /// In the order of their cost.
  std::vector<RowTimeCandidate> candidates;
  /// Reason why there are no candidates, and what to add.
  std::string problem;
};

/// The row time, or why there is none and what to add.
struct RowTimeResult {
  std::optional<RowTime> found;
  std::string problem;
};

/// A candidate is the answer if every other one costs this much more: it is then exp(-4) times as
/// likely, about 2 %.
inline constexpr double kClearCost = 4;

/// Residuals beyond this many standard deviations count as this many: a lamp that is off its
/// frequency or its place, or another light, misleads little.
inline constexpr double kMaxResidualSds = 20;

/// Finds the row times that explain the lights of lamps whose frequencies the map knows. A lamp of
/// frequency f has a period of 1 / (f row_time) lines (lib/THEORY.md, "Identity"), so that for
/// lamp k of light i
///
///     log row_time = -log period_i - log f_k.
///
/// Lights of one lamp, or of one period, are made one group by their median. Which lamp an
/// unlabelled group is of is not known. Each row time that puts some lamp's frequency to some
/// period is refined by iterated least squares, and has the cost
///
///     sum over groups of min over lamps of log(1 + r^2 / s^2) + log(1 + d^2 / 0.1^2),
///
/// r the residual above, s^2 = sd^2 + 0.003^2, where a lamp serves for one group, and a residual
/// beyond kMaxResidualSds 0.003 counts as that; d the measured duty less the lamp's, where all
/// lamps with a frequency state their duty.
///
/// @return  the row times that differ by 2 % or more and cost less than the best one plus
///          kClearCost; a problem if there is none
RowTimeCandidates estimate_row_time(std::span<const MeasuredPeriod> lights, const LampMap& lamps);

/// Chooses the candidate with the least cost.
///
/// @param position_costs  cost of the lamps' places for each candidate, added to its own; empty if
///                        not known
/// @return  a problem if another candidate costs less than kClearCost more, as when all ratios of
///          frequencies are equal, or if less than half of the groups have a lamp
RowTimeResult choose_row_time(const RowTimeCandidates& found,
                              std::span<const double> position_costs = {});

}  // namespace vlp
