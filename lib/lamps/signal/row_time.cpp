// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/row_time.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "geometry/median.h"
#include "geometry/statistical_bounds.h"

namespace vlp {
namespace {

PeriodGroup make_period_group(std::span<const MeasuredPeriod> lights,
                              std::vector<std::size_t> members, std::optional<int> lamp) {
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

constexpr double kScatter = 0.003, kFarthest = kMaxResidualSds * kScatter;
constexpr double kMinRowTime_s = 1e-8, kMaxRowTime_s = 1e-3;  // valid range of a calibration
/// Standard deviation of a measured duty about that of the map. Blur and a long exposure bias it
/// towards 0.5; saturation increases it.
constexpr double kDutySd = 0.1;

double compute_variance(const PeriodGroup& group) {
  return group.sd * group.sd + kScatter * kScatter;
}

double compute_cost(const PeriodGroup& group, double residual) {
  return std::log1p(residual * residual / compute_variance(group));
}

double compute_weight(const PeriodGroup& group, double residual) {
  return 1 / (compute_variance(group) + residual * residual);
}

/// Assignment of period groups to the lamps of a map under one row time.
struct PeriodMatch {
  double log_row_time;
  /// Cost of the assignment, see list_row_time_candidates().
  double cost;
  /// Residual of each group in log period; std::nullopt if no lamp is assigned.
  std::vector<std::optional<double>> residuals;
  /// Possible lamps of each group: its label, or all lamps with its frequency.
  std::vector<std::vector<int>> lamps;
};

/// Matcher of period groups to the lamps of a map that have a frequency.
class PeriodMatching {
 public:
  PeriodMatching(std::vector<PeriodGroup> groups, const LampMap& lamps)
      : groups_(std::move(groups)) {
    for (const Lamp& lamp : lamps.lamps) {
      if (!lamp.frequency_hz) continue;
      const double value = std::log(*lamp.frequency_hz);
      log_frequency_[lamp.id] = value;
      lamps_[value].push_back(lamp.id);
      if (lamp.duty) duty_[lamp.id] = *lamp.duty;
    }
    if (duty_.size() < log_frequency_.size()) duty_.clear();
  }

  /// Returns a refined match for every row time that maps the frequency of a lamp to the period of
  /// a group.
  std::vector<PeriodMatch> list_row_time_matches() const {
    std::vector<PeriodMatch> all;
    for (const PeriodGroup& group : groups_) {
      for (const auto& [log_frequency, lamps] : lamps_) {
        if (group.lamp && std::ranges::find(lamps, *group.lamp) == lamps.end()) continue;
        const double start = -group.log_period - log_frequency;
        if (start < std::log(kMinRowTime_s) || start > std::log(kMaxRowTime_s)) continue;
        all.push_back(refine_row_time_match(start));
      }
    }
    return all;
  }

 private:
  using LampsByLogFrequency = std::map<double, std::vector<int>>;

  PeriodMatch refine_row_time_match(double log_row_time) const {
    constexpr int steps = 20;
    PeriodMatch match = evaluate_row_time_match(log_row_time);
    for (int step = 0; step < steps; ++step) {
      double weights = 0, sum = 0;
      for (std::size_t i = 0; i < groups_.size(); ++i) {
        if (!match.residuals[i]) continue;
        const double weight = compute_weight(groups_[i], *match.residuals[i]);
        weights += weight;
        sum += weight * *match.residuals[i];
      }
      if (!(weights > 0)) break;
      match = evaluate_row_time_match(match.log_row_time + sum / weights);
    }
    return match;
  }

  PeriodMatch evaluate_row_time_match(double log_row_time) const {
    PeriodMatch match{log_row_time, 0, {}, {}};
    match.residuals.resize(groups_.size());
    match.lamps.resize(groups_.size());
    std::map<double, std::size_t> taken;  // frequency -> group
    std::vector<LampsByLogFrequency::const_iterator> nearest(groups_.size(), lamps_.end());
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      nearest[i] = look_up_nearest_lamps(groups_[i], log_row_time);
      if (nearest[i] == lamps_.end()) continue;
      const double residual = -groups_[i].log_period - nearest[i]->first - log_row_time;
      if (std::abs(residual) > kFarthest) continue;
      if (!groups_[i].lamp) {
        const auto [other, is_free] = taken.try_emplace(nearest[i]->first, i);
        if (!is_free) {
          auto& there = match.residuals[other->second];
          if (std::abs(residual) >= std::abs(*there)) continue;
          there.reset();
          other->second = i;
        }
      }
      match.residuals[i] = residual;
    }
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      match.cost += compute_cost(groups_[i], match.residuals[i].value_or(kFarthest));
      if (!match.residuals[i]) continue;
      match.lamps[i] = groups_[i].lamp ? std::vector{*groups_[i].lamp} : nearest[i]->second;
      match.cost += compute_duty_cost(groups_[i], match.lamps[i]);
    }
    return match;
  }

  LampsByLogFrequency::const_iterator look_up_nearest_lamps(const PeriodGroup& group,
                                                            double log_row_time) const {
    if (group.lamp) {
      const auto known = log_frequency_.find(*group.lamp);
      return known == log_frequency_.end() ? lamps_.end() : lamps_.find(known->second);
    }
    const double wanted = -group.log_period - log_row_time;
    const auto above = lamps_.lower_bound(wanted);
    if (above == lamps_.begin()) return above;
    const auto below = std::prev(above);
    const bool above_is_nearer =
        above != lamps_.end() && above->first - wanted < wanted - below->first;
    return above_is_nearer ? above : below;
  }

  /// Returns the cost of the group's duty if the group is one of these lamps.
  double compute_duty_cost(const PeriodGroup& group, const std::vector<int>& lamps) const {
    if (duty_.empty() || !group.duty) return 0;
    double min_difference = std::numeric_limits<double>::infinity();
    for (const int lamp : lamps)
      min_difference = std::min(min_difference, std::abs(*group.duty - duty_.at(lamp)));
    return std::log1p(min_difference * min_difference / (kDutySd * kDutySd));
  }

  std::vector<PeriodGroup> groups_;
  LampsByLogFrequency lamps_;
  std::map<int, double> log_frequency_;  // by lamp
  std::map<int, double> duty_;           // by lamp; empty unless all have one
};

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
  if (lamps > 1) {
    const double scatter = squares / (lamps - 1) / lamps * compute_student_factor(lamps - 1);
    variance = std::max(variance, scatter);
  }
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

std::vector<PeriodGroup> group_lights(std::span<const MeasuredPeriod> lights) {
  std::map<int, std::vector<std::size_t>> labeled;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    (lights[i].lamp ? labeled[*lights[i].lamp] : others).push_back(i);
  }
  std::vector<PeriodGroup> groups;
  groups.reserve(labeled.size());
  for (auto& [lamp, members] : labeled) {
    groups.push_back(make_period_group(lights, std::move(members), lamp));
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
    groups.push_back(make_period_group(lights, std::move(group), std::nullopt));
  }
  return groups;
}

RowTimeCandidates list_row_time_candidates(std::span<const MeasuredPeriod> lights,
                                           const LampMap& lamps) {
  RowTimeCandidates found{group_lights(lights), {}, {}};
  if (found.groups.empty()) {
    found.problem =
        "no light has clear stripes: add captures with lamps nearer, larger or sharper, and with a "
        "short exposure";
    return found;
  }
  std::vector<PeriodMatch> matches = PeriodMatching(found.groups, lamps).list_row_time_matches();
  if (matches.empty()) {
    found.problem =
        "no lamp of the map has one of the measured periods: are its frequencies right?";
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

RowTimeResult select_row_time(const RowTimeCandidates& found,
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
    // [LAMP-14] `measured stripe periods fit`
    return {{},
            "the " + groups + " measured stripe periods fit a row time of " +
                format_microseconds(best.row_time.row_time_s) + " and one of " +
                format_microseconds(ranked[1].second->row_time.row_time_s) +
                ", and neither duties nor positions of the lamps decide: add captures with more "
                "lamps, or a table of the lamps in the images (--labels)"};
  }
  const auto explained = std::count_if(best.lamps.begin(), best.lamps.end(),
                                       [](const auto& lamps) { return !lamps.empty(); });
  if (2 * explained < std::ptrdiff_t(found.groups.size())) {
    // [LAMP-14] `measured stripe periods: are`, `no row time explains` | map of another room, or
    //   with wrong or missing lamps; two row times fit the periods | correct the map, state the row
    //   time, or use `vlp-train --row-time --labels`
    return {{},
            "no row time explains more than " + std::to_string(explained) + " of the " + groups +
                " measured stripe periods: are the frequencies in the lamp map right, and all "
                "lamps in it?"};
  }
  return {best.row_time, {}};
}

}  // namespace vlp
