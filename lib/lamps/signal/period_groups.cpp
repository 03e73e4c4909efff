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

PeriodGroup group_of(const std::vector<double>& log_periods, std::optional<int> lamp) {
  PeriodGroup group{upper_median(log_periods), 0, static_cast<int>(log_periods.size()), lamp};
  std::vector<double> offs;
  offs.reserve(log_periods.size());
  for (const double value : log_periods) offs.push_back(std::abs(value - group.log_period));
  // A median scatters 1.25 times as much as a mean. Three lights or less do not show their scatter.
  constexpr double single = 0.003, least = 1e-5, sd_of_mad = 1.4826, sd_of_median = 1.2533;
  const double scatter = group.lights > 3 ? sd_of_mad * upper_median(std::move(offs)) : single;
  group.sd = std::max(least, sd_of_median * scatter / std::sqrt(double(group.lights)));
  return group;
}

/// Takes the densest group out of `sorted`.
std::vector<double> densest(std::vector<double>& sorted) {
  constexpr double half_width = 0.015;
  std::size_t best_begin = 0, best_end = 0;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); ++begin) {
    while (end < sorted.size() && sorted[end] <= sorted[begin] + 2 * half_width) ++end;
    if (end - begin > best_end - best_begin) best_begin = begin, best_end = end;
  }
  const auto first = sorted.begin() + std::ptrdiff_t(best_begin);
  const auto last = sorted.begin() + std::ptrdiff_t(best_end);
  std::vector<double> group(first, last);
  sorted.erase(first, last);
  return group;
}

}  // namespace

std::vector<PeriodGroup> period_groups(std::span<const MeasuredPeriod> lights) {
  std::map<int, std::vector<double>> labelled;
  std::vector<double> others;
  for (const MeasuredPeriod& light : lights) {
    (light.lamp ? labelled[*light.lamp] : others).push_back(std::log(light.period_lines));
  }
  std::vector<PeriodGroup> groups;
  groups.reserve(labelled.size());
  for (const auto& [lamp, log_periods] : labelled) groups.push_back(group_of(log_periods, lamp));
  std::sort(others.begin(), others.end());
  const std::size_t all = others.size();
  std::size_t largest = 0;
  while (!others.empty()) {
    const std::vector<double> group = densest(others);
    largest = std::max(largest, group.size());
    if (10 * group.size() < largest || 50 * group.size() < all) break;
    groups.push_back(group_of(group, std::nullopt));
  }
  return groups;
}

}  // namespace vlp
