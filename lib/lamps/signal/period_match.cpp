// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/period_match.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vlp {
namespace {

constexpr double kFarthest = 0.06, kScatter = 0.003;
constexpr double kShortest_s = 1e-8, kLongest_s = 1e-3;  // what a calibration may hold

double variance_of(const PeriodGroup& group) { return group.sd * group.sd + kScatter * kScatter; }

double cost_of(const PeriodGroup& group, double residual) {
  return std::log1p(residual * residual / variance_of(group));
}

double weight_of(const PeriodGroup& group, double residual) {
  return 1 / (variance_of(group) + residual * residual);
}

}  // namespace

PeriodMatching::PeriodMatching(std::vector<PeriodGroup> groups, const LampMap& lamps)
    : groups_(std::move(groups)) {
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) continue;
    const double value = std::log(*lamp.frequency_hz);
    log_frequency_[lamp.id] = value;
    log_frequencies_.push_back(value);
  }
  std::sort(log_frequencies_.begin(), log_frequencies_.end());
  const auto end = std::unique(log_frequencies_.begin(), log_frequencies_.end());
  log_frequencies_.erase(end, log_frequencies_.end());
}

std::vector<PeriodMatch> PeriodMatching::matches() const {
  std::vector<PeriodMatch> all;
  for (const PeriodGroup& group : groups_) {
    const auto known = group.lamp ? log_frequency_.find(*group.lamp) : log_frequency_.end();
    for (const double log_frequency : log_frequencies_) {
      if (group.lamp && (known == log_frequency_.end() || known->second != log_frequency)) continue;
      const double start = -group.log_period - log_frequency;
      if (start < std::log(kShortest_s) || start > std::log(kLongest_s)) continue;
      all.push_back(refined(start));
    }
  }
  return all;
}

PeriodMatch PeriodMatching::refined(double log_row_time) const {
  constexpr int steps = 20;
  PeriodMatch match = matched(log_row_time);
  for (int step = 0; step < steps; ++step) {
    double weights = 0, sum = 0;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (!match.residuals[i]) continue;
      const double weight = weight_of(groups_[i], *match.residuals[i]);
      weights += weight;
      sum += weight * *match.residuals[i];
    }
    if (!(weights > 0)) break;
    match = matched(match.log_row_time + sum / weights);
  }
  return match;
}

PeriodMatch PeriodMatching::matched(double log_row_time) const {
  PeriodMatch match{log_row_time, 0, std::vector<std::optional<double>>(groups_.size())};
  std::map<double, std::size_t> taken;  // frequency -> group
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const auto nearest = nearest_frequency(groups_[i], log_row_time);
    if (!nearest) continue;
    const double residual = -groups_[i].log_period - *nearest - log_row_time;
    if (std::abs(residual) > kFarthest) continue;
    if (!groups_[i].lamp) {
      const auto [other, is_free] = taken.try_emplace(*nearest, i);
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
    match.cost += cost_of(groups_[i], match.residuals[i].value_or(kFarthest));
  }
  return match;
}

std::optional<double> PeriodMatching::nearest_frequency(const PeriodGroup& group,
                                                        double log_row_time) const {
  if (group.lamp) {
    const auto known = log_frequency_.find(*group.lamp);
    return known == log_frequency_.end() ? std::nullopt : std::optional(known->second);
  }
  const double wanted = -group.log_period - log_row_time;
  const auto nearest = std::min_element(
      log_frequencies_.begin(), log_frequencies_.end(),
      [&](double a, double b) { return std::abs(a - wanted) < std::abs(b - wanted); });
  return *nearest;
}

}  // namespace vlp
