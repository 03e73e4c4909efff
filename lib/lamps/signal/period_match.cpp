// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/period_match.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "lamps/signal/row_time.h"

namespace vlp {
namespace {

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

}  // namespace

PeriodMatching::PeriodMatching(std::vector<PeriodGroup> groups, const LampMap& lamps)
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

std::vector<PeriodMatch> PeriodMatching::matches() const {
  std::vector<PeriodMatch> all;
  for (const PeriodGroup& group : groups_) {
    const auto known = group.lamp ? log_frequency_.find(*group.lamp) : log_frequency_.end();
    for (const auto& [log_frequency, lamps] : lamps_) {
      if (group.lamp && (known == log_frequency_.end() || known->second != log_frequency)) continue;
      const double start = -group.log_period - log_frequency;
      if (start < std::log(kMinRowTime_s) || start > std::log(kMaxRowTime_s)) continue;
      all.push_back(refine_match(start));
    }
  }
  return all;
}

PeriodMatch PeriodMatching::refine_match(double log_row_time) const {
  constexpr int steps = 20;
  PeriodMatch match = evaluate_match(log_row_time);
  for (int step = 0; step < steps; ++step) {
    double weights = 0, sum = 0;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (!match.residuals[i]) continue;
      const double weight = compute_weight(groups_[i], *match.residuals[i]);
      weights += weight;
      sum += weight * *match.residuals[i];
    }
    if (!(weights > 0)) break;
    match = evaluate_match(match.log_row_time + sum / weights);
  }
  return match;
}

PeriodMatch PeriodMatching::evaluate_match(double log_row_time) const {
  PeriodMatch match{log_row_time, 0, {}, {}};
  match.residuals.resize(groups_.size());
  match.lamps.resize(groups_.size());
  std::map<double, std::size_t> taken;  // frequency -> group
  std::vector<LampsByLogFrequency::const_iterator> nearest(groups_.size(), lamps_.end());
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    nearest[i] = find_nearest_frequency(groups_[i], log_row_time);
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

PeriodMatching::LampsByLogFrequency::const_iterator PeriodMatching::find_nearest_frequency(
    const PeriodGroup& group, double log_row_time) const {
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

double PeriodMatching::compute_duty_cost(const PeriodGroup& group,
                                         const std::vector<int>& lamps) const {
  if (duty_.empty() || !group.duty) return 0;
  double min_difference = std::numeric_limits<double>::infinity();
  for (const int lamp : lamps)
    min_difference = std::min(min_difference, std::abs(*group.duty - duty_.at(lamp)));
  return std::log1p(min_difference * min_difference / (kDutySd * kDutySd));
}

}  // namespace vlp
