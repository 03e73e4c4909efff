// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/lamp_map.h"

namespace vlp {

/// Stripe period of a light, in scanlines, with its lamp and duty cycle if known.
struct MeasuredPeriod {
  double period_lines;
  /// Id of the lamp that makes the light, from a table of labels; std::nullopt if the light has no
  /// label.
  std::optional<int> lamp;
  /// Lit fraction of a period, if it was measured.
  std::optional<double> duty = {};
};

/// Lights with the same period, which are assumed to be one lamp.
struct PeriodGroup {
  /// Median of the natural logarithm of period_lines, and its standard deviation (relative error of
  /// the period).
  double log_period;
  double sd;
  /// Indices of the lights of the group in the input of group_lights().
  std::vector<std::size_t> lights;
  std::optional<int> lamp;
  /// Median of the measured duties; std::nullopt if there is none.
  std::optional<double> duty;
};

/// Groups lights with a label by their lamp. Groups the others by density of their periods: within
/// 1.5 % of the period with most neighbors. Discards groups with less than 10 % of the lights of
/// the largest group, or with less than 2 % of these lights. These are partly hidden lights.
std::vector<PeriodGroup> group_lights(std::span<const MeasuredPeriod> lights);

struct RowTime {
  double row_time_s;
  /// Standard deviation; 1.96 of them cover 95 % or more. Includes the scatter of the lamps about
  /// their frequencies, with Student's factor, and of the lights about their lamps. Also includes
  /// 0.05 %, a common relative error of all measured periods. With one lamp only, the error of its
  /// frequency is not included.
  double sd_s;
  /// Number of lamps that determine the row time, and number of their lights.
  int lamps, lights;
};

/// Row time that explains the measured periods, with the assignment of groups to lamps.
struct RowTimeCandidate {
  RowTime row_time;
  /// Cost, see list_row_time_candidates().
  double cost;
  /// Possible lamps of each group, by the index of the group: those with the resulting frequency;
  /// empty if no lamp has it.
  std::vector<std::vector<int>> lamps;
};

struct RowTimeCandidates {
  std::vector<PeriodGroup> groups;
  /// Candidates, in the order of their cost.
  std::vector<RowTimeCandidate> candidates;
  /// Reason for the lack of candidates, with a remedy.
  std::string problem;
};

/// Row time, or the reason for its lack with a remedy.
struct RowTimeResult {
  std::optional<RowTime> row_time;
  std::string problem;
};

/// Minimum cost difference of all other candidates to the chosen one. Another candidate is then
/// exp(-4) times as likely, about 2 %.
inline constexpr double kClearCost = 4;

/// Maximum of a residual, in standard deviations; larger residuals are clamped. This limits the
/// effect of a lamp with a wrong frequency or position, or of another light.
inline constexpr double kMaxResidualSds = 20;

/// Estimates the row times that explain the lights of lamps with frequencies in the map. A lamp of
/// frequency f has a period of 1 / (f row_time) scanlines (lib/THEORY.md, "Identity"), so that for
/// lamp k of light i
///
///     log row_time = -log period_i - log f_k.
///
/// Lights of one lamp, or of one period, form one group with their median period. The lamp of an
/// unlabeled group is unknown. Each row time that maps the frequency of some lamp to some period is
/// refined by iterated least squares, and has the cost
///
///     sum over groups of min over lamps of log(1 + r^2 / s^2) + log(1 + d^2 / 0.1^2).
///
/// - r is the residual of the equation above; residuals beyond kMaxResidualSds 0.003 are clamped.
/// - s^2 = sd^2 + 0.003^2, with the standard deviation sd of the group's log period.
/// - d is the difference between the measured duty and that of the lamp, used if the map has the
///   duties of all lamps with a frequency.
///
/// Each frequency is assigned to at most one unlabeled group.
///
/// @return  the row times that differ by 2 % or more and cost less than the best one plus
///        kClearCost; a problem if there is none
RowTimeCandidates list_row_time_candidates(std::span<const MeasuredPeriod> lights,
                                           const LampMap& lamps);

/// Selects the candidate with the smallest cost.
///
/// @param position_costs  cost of the lamps' positions for each candidate, added to its own cost;
///        empty if unknown
/// @return a problem if another candidate costs less than kClearCost more, as with equal ratios of
///     all frequencies; also if less than half of the groups have a lamp
RowTimeResult select_row_time(const RowTimeCandidates& found,
                              std::span<const double> position_costs = {});

}  // namespace vlp
