// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/row_time.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>

#include "lamps/signal/period_match.h"

namespace vlp {
namespace {

RowTime make_row_time(const PeriodMatch& match, const std::vector<PeriodGroup>& groups) {
  constexpr double common_error = 5e-4;  // common relative error of measured periods
  double squares = 0, information = 0;
  int lamps = 0, lights = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (!match.residuals[i]) continue;
    squares += std::pow(*match.residuals[i], 2);
    information += 1 / (groups[i].sd * groups[i].sd);
    ++lamps;
    lights += static_cast<int>(groups[i].lights.size());
  }
  double variance = 1 / information;
  // The scatter is not weighted, because five lamps do not reveal which of them is the most
  // reliable.
  if (lamps > 1) variance = std::max(variance, squares / (lamps - 1) / lamps);
  variance += common_error * common_error;
  const double row_time_s = std::exp(match.log_row_time);
  return {row_time_s, row_time_s * std::sqrt(variance), lamps, lights};
}

std::string format_microseconds(double row_time_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f us", 1e6 * row_time_s);
  return text;
}

}  // namespace

RowTimeCandidates estimate_row_time(std::span<const MeasuredPeriod> lights, const LampMap& lamps) {
  RowTimeCandidates found{group_periods(lights), {}, {}};
  if (found.groups.empty()) {
    found.problem =
        "no light has clear stripes: add captures with lamps nearer, larger or sharper, and with a "
        "short exposure";
    return found;
  }
  std::vector<PeriodMatch> matches = PeriodMatching(found.groups, lamps).matches();
  if (matches.empty()) {
    found.problem =
        "no lamp of the map can have the periods that are seen: are its frequencies right?";
    return found;
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const auto& a, const auto& b) { return a.cost < b.cost; });
  constexpr double same = 0.02;
  for (PeriodMatch& match : matches) {
    if (match.cost >= matches.front().cost + kClearCost) break;
    const RowTime row_time = make_row_time(match, found.groups);
    const bool is_known = std::any_of(
        found.candidates.begin(), found.candidates.end(), [&](const RowTimeCandidate& other) {
          return std::abs(std::log(row_time.row_time_s / other.row_time.row_time_s)) < same;
        });
    if (!is_known) found.candidates.push_back({row_time, match.cost, match.lamps});
  }
  return found;
}

RowTimeResult choose_row_time(const RowTimeCandidates& found,
                              std::span<const double> position_costs) {
  if (found.candidates.empty()) return {{}, found.problem};
  assert(position_costs.empty() || position_costs.size() == found.candidates.size());
  std::vector<std::pair<double, const RowTimeCandidate*>> ranked;
  for (std::size_t i = 0; i < found.candidates.size(); ++i) {
    const double position_cost = position_costs.empty() ? 0 : position_costs[i];
    ranked.emplace_back(found.candidates[i].cost + position_cost, &found.candidates[i]);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const RowTimeCandidate& best = *ranked.front().second;
  const std::string groups = std::to_string(found.groups.size());
  if (ranked.size() > 1 && ranked[1].first < ranked[0].first + kClearCost) {
    return {{},
            "the " + groups + " stripe periods that are seen fit a row time of " +
                format_microseconds(best.row_time.row_time_s) + " and one of " +
                format_microseconds(ranked[1].second->row_time.row_time_s) +
                ", and neither the duties nor the places of the lamps decide: add captures that "
                "show more "
                "lamps, or a table that says which lamp is which"};
  }
  const auto explained = std::count_if(best.lamps.begin(), best.lamps.end(),
                                       [](const auto& lamps) { return !lamps.empty(); });
  if (2 * explained < std::ptrdiff_t(found.groups.size())) {
    return {{},
            "no row time explains more than " + std::to_string(explained) + " of the " + groups +
                " stripe periods that are seen: are the frequencies of the lamp map right, and "
                "all lamps in it?"};
  }
  return {best.row_time, {}};
}

}  // namespace vlp
