// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/period_groups.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/median.h"

namespace vlp {
namespace {

PeriodGroup make_group(std::span<const MeasuredPeriod> lights, std::vector<std::size_t> members,
                       std::optional<int> lamp) {
  std::vector<double> log_periods, duties;
  log_periods.reserve(members.size());
  for (const std::size_t member : members) {
    log_periods.push_back(std::log(lights[member].period_lines));
    if (lights[member].duty) duties.push_back(*lights[member].duty);
  }
  PeriodGroup group{upper_median(log_periods), 0, std::move(members), lamp, {}};
  if (!duties.empty()) group.duty = upper_median(std::move(duties));
  for (double& value : log_periods) value = std::abs(value - group.log_period);
  // The standard deviation of a median is 1.25 times that of a mean. Three lights or less do not
  // determine their scatter.
  constexpr double single = 0.003, min_sd = 1e-5, sd_of_mad = 1.4826, sd_of_median = 1.2533;
  const std::size_t count = group.lights.size();
  const double scatter = count > 3 ? sd_of_mad * upper_median(std::move(log_periods)) : single;
  group.sd = std::max(min_sd, sd_of_median * scatter / std::sqrt(double(count)));
  return group;
}

/// Removes the densest group from `sorted`, indices of lights in the order of their periods, and
/// returns it.
std::vector<std::size_t> remove_densest_group(std::span<const MeasuredPeriod> lights,
                                              std::vector<std::size_t>& sorted) {
  constexpr double half_width = 0.015;
  const auto log_period = [&](std::size_t i) { return std::log(lights[sorted[i]].period_lines); };
  std::size_t best_begin = 0, best_end = 0;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); ++begin) {
    while (end < sorted.size() && log_period(end) <= log_period(begin) + 2 * half_width) ++end;
    if (end - begin > best_end - best_begin) best_begin = begin, best_end = end;
  }
  const auto first = sorted.begin() + std::ptrdiff_t(best_begin);
  const auto last = sorted.begin() + std::ptrdiff_t(best_end);
  std::vector<std::size_t> group(first, last);
  sorted.erase(first, last);
  return group;
}

}  // namespace

std::vector<PeriodGroup> group_periods(std::span<const MeasuredPeriod> lights) {
  std::map<int, std::vector<std::size_t>> labeled;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    (lights[i].lamp ? labeled[*lights[i].lamp] : others).push_back(i);
  }
  std::vector<PeriodGroup> groups;
  groups.reserve(labeled.size());
  for (auto& [lamp, members] : labeled) {
    groups.push_back(make_group(lights, std::move(members), lamp));
  }
  std::sort(others.begin(), others.end(), [&](std::size_t a, std::size_t b) {
    return lights[a].period_lines < lights[b].period_lines;
  });
  const std::size_t all = others.size();
  std::size_t largest = 0;
  while (!others.empty()) {
    std::vector<std::size_t> group = remove_densest_group(lights, others);
    largest = std::max(largest, group.size());
    if (10 * group.size() < largest || 50 * group.size() < all) break;
    groups.push_back(make_group(lights, std::move(group), std::nullopt));
  }
  return groups;
}

}  // namespace vlp
