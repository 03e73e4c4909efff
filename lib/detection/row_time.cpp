// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/row_time.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "detection/period_groups.h"

namespace vlp {
namespace {

constexpr double kFarthest = 0.06, kScatter = 0.003;
constexpr double kMeasuring = 5e-4;  // how far measured periods may be off together
constexpr double kShortest_s = 1e-8, kLongest_s = 1e-3;  // what a calibration may hold

double variance_of(const PeriodGroup& group) { return group.sd * group.sd + kScatter * kScatter; }

double cost_of(const PeriodGroup& group, double residual) {
  return std::log1p(residual * residual / variance_of(group));
}

/// What a row time makes of the groups: of each the residual to its lamp, if it has one.
struct Match {
  double log_row_time;
  double cost = 0;
  std::vector<std::optional<double>> residuals;
};

class Matching {
 public:
  Matching(std::vector<PeriodGroup> groups, const LampMap& lamps) : groups_(std::move(groups)) {
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

  std::vector<Match> matches() const {
    std::vector<Match> all;
    for (const PeriodGroup& group : groups_) {
      const auto known = group.lamp ? log_frequency_.find(*group.lamp) : log_frequency_.end();
      for (const double log_frequency : log_frequencies_) {
        if (group.lamp && (known == log_frequency_.end() || known->second != log_frequency))
          continue;
        const double start = -group.log_period - log_frequency;
        if (start < std::log(kShortest_s) || start > std::log(kLongest_s)) continue;
        all.push_back(refined(start));
      }
    }
    return all;
  }

  RowTime row_time(const Match& match) const {
    double squares = 0, information = 0;
    int lamps = 0, lights = 0;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (!match.residuals[i]) continue;
      squares += std::pow(*match.residuals[i], 2);
      information += 1 / (groups_[i].sd * groups_[i].sd);
      ++lamps;
      lights += groups_[i].lights;
    }
    double variance = 1 / information;
    // Not weighted: five lamps cannot show which of them is the one to trust.
    if (lamps > 1) variance = std::max(variance, squares / (lamps - 1) / lamps);
    variance += kMeasuring * kMeasuring;
    const double row_time_s = std::exp(match.log_row_time);
    return {row_time_s, row_time_s * std::sqrt(variance), lamps, lights};
  }

 private:
  static double weight_of(const PeriodGroup& group, double residual) {
    return 1 / (variance_of(group) + residual * residual);
  }

  Match refined(double log_row_time) const {
    constexpr int steps = 20;
    Match match = matched(log_row_time);
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

  Match matched(double log_row_time) const {
    Match match{log_row_time, 0, std::vector<std::optional<double>>(groups_.size())};
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

  std::optional<double> nearest_frequency(const PeriodGroup& group, double log_row_time) const {
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

  std::vector<PeriodGroup> groups_;
  std::vector<double> log_frequencies_;  // different ones, in order
  std::map<int, double> log_frequency_;  // by lamp
};

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
  const Matching matching(groups, lamps);
  const std::vector<Match> matches = matching.matches();
  const auto best = std::min_element(matches.begin(), matches.end(),
                                     [](auto& a, auto& b) { return a.cost < b.cost; });
  if (best == matches.end()) {
    return {{},
            "no lamp of the map can have the periods that are seen: are its frequencies right?"};
  }
  constexpr double same = 0.02, clear = 4;
  const Match* rival = nullptr;
  for (const Match& match : matches) {
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
  return {matching.row_time(*best), {}};
}

}  // namespace vlp
