// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/row_time.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "lamps/signal/period_match.h"

namespace vlp {
namespace {

RowTime row_time_of(const PeriodMatch& match, const std::vector<PeriodGroup>& groups) {
  constexpr double measuring = 5e-4;  // how far measured periods may be off together
  double squares = 0, information = 0;
  int lamps = 0, lights = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (!match.residuals[i]) continue;
    squares += std::pow(*match.residuals[i], 2);
    information += 1 / (groups[i].sd * groups[i].sd);
    ++lamps;
    lights += groups[i].lights;
  }
  double variance = 1 / information;
  // Not weighted: five lamps cannot show which of them is the one to trust.
  if (lamps > 1) variance = std::max(variance, squares / (lamps - 1) / lamps);
  variance += measuring * measuring;
  const double row_time_s = std::exp(match.log_row_time);
  return {row_time_s, row_time_s * std::sqrt(variance), lamps, lights};
}

std::string microseconds(double log_row_time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f us", 1e6 * std::exp(log_row_time));
  return text;
}

}  // namespace

RowTimeResult estimate_row_time(std::span<const MeasuredPeriod> lights, const LampMap& lamps) {
  const std::vector<PeriodGroup> groups = period_groups(lights);
  if (groups.empty()) {
    return {{},
            "no light has clear stripes: add captures with lamps nearer, larger or sharper, and "
            "with a short exposure"};
  }
  const std::vector<PeriodMatch> matches = PeriodMatching(groups, lamps).matches();
  const auto best = std::min_element(matches.begin(), matches.end(),
                                     [](auto& a, auto& b) { return a.cost < b.cost; });
  if (best == matches.end()) {
    return {{},
            "no lamp of the map can have the periods that are seen: are its frequencies right?"};
  }
  constexpr double same = 0.02, clear = 4;
  const PeriodMatch* rival = nullptr;
  for (const PeriodMatch& match : matches) {
    if (std::abs(match.log_row_time - best->log_row_time) < same) continue;
    if (rival == nullptr || match.cost < rival->cost) rival = &match;
  }
  if (rival != nullptr && rival->cost < best->cost + clear) {
    return {{},
            "the " + std::to_string(groups.size()) +
                " stripe periods that are seen fit a row time of " +
                microseconds(best->log_row_time) + " and one of " +
                microseconds(rival->log_row_time) +
                ": add captures that show more lamps, or a table that says which lamp is which"};
  }
  const auto explained = std::count_if(best->residuals.begin(), best->residuals.end(),
                                       [](const auto& residual) { return residual.has_value(); });
  if (2 * explained < std::ptrdiff_t(groups.size())) {
    return {{},
            "no row time explains more than " + std::to_string(explained) + " of the " +
                std::to_string(groups.size()) +
                " stripe periods that are seen: are the frequencies of the lamp map right, and "
                "all lamps in it?"};
  }
  return {row_time_of(*best, groups), {}};
}

}  // namespace vlp
