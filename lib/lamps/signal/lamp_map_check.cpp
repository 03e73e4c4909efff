// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_map_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "lamps/signal/frequency_identification.h"
#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

double compute_exposure_lines(const StripeConditions& conditions) {
  return conditions.exposure_s.value_or(0) / conditions.row_time_s;
}

/// Returns the relative standard deviation of a lamp's period; 0 if the size of the lamp is
/// unknown.
double predict_lamp_sd(const Lamp& lamp, const StripeConditions& conditions) {
  const auto lines = count_scanlines(lamp, conditions);
  if (!lines) return 0;
  const double period = 1 / (*lamp.frequency_hz * conditions.row_time_s);
  return predict_period_sd(period, *lines, compute_exposure_lines(conditions));
}

bool have_similar_duties(const Lamp& a, const Lamp& b) {
  return !a.duty || !b.duty || std::abs(*a.duty - *b.duty) < 2 * kDutyMargin;
}

/// Lists the rooms in alphabetical order, such as "hall, office"; the first ten of more.
std::string list_rooms(const std::vector<std::string>& rooms) {
  constexpr std::size_t max_listed = 10;
  std::set<std::string> names(rooms.begin(), rooms.end());
  names.erase("");
  std::string list;
  std::size_t count = 0;
  for (const std::string& name : names) {
    if (count++ == max_listed) {
      return list + " and " + std::to_string(names.size() - max_listed) + " more";
    }
    list += (list.empty() ? "" : ", ") + name;
  }
  return list;
}

}  // namespace

bool are_indistinguishable(const Lamp& a, const Lamp& b) {
  return a.frequency_hz && b.frequency_hz &&
         std::abs(std::log(*a.frequency_hz / *b.frequency_hz)) < kLampDrift &&
         have_similar_duties(a, b);
}

std::string explain_room_choice(const LampMapFile& lamps, const std::string& argument) {
  const auto& [file, map, rooms] = lamps;
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    for (std::size_t j = i + 1; j < map.lamps.size(); ++j) {
      if (rooms[i].empty() || rooms[j].empty() || rooms[i] == rooms[j]) continue;
      if (!are_indistinguishable(map.lamps[i], map.lamps[j])) continue;
      // [LAMP-10] `share a frequency` | map of several rooms | [rooms](vlp-train.md#rooms)
      return "lamps " + std::to_string(map.lamps[i].id) + " and " +
             std::to_string(map.lamps[j].id) +
             " share a frequency in two rooms: choose a room with " + argument +
             "; the map has: " + list_rooms(rooms);
    }
  }
  return "";
}

std::optional<double> count_scanlines(const Lamp& lamp, const StripeConditions& conditions) {
  const double above_m = lamp.position_m.z() - conditions.camera_height_m;
  const auto& size_m = lamp.shape.size_m;
  if (!size_m || !conditions.focal_px || !(above_m > 0)) return std::nullopt;
  return size_m->minCoeff() * *conditions.focal_px / above_m;
}

double predict_period_sd(double period_lines, double lines, double exposure_lines) {
  const double periods = kUsedHeight * lines / period_lines;
  if (periods < kMinPeriods) return std::numeric_limits<double>::infinity();
  constexpr double noise = 0.02, blunt_lines = 1.2;
  const double sharp = std::max(0.0, 1 - exposure_lines / blunt_lines) / std::sqrt(12.0);
  const double edge = std::hypot(sharp, noise * exposure_lines);
  return edge / period_lines * std::sqrt(6 / (periods * (periods * periods - 1)));
}

std::vector<AmbiguousLamps> list_ambiguous_lamps(const LampMap& lamps,
                                                 const StripeConditions& conditions) {
  std::vector<AmbiguousLamps> pairs;
  for (std::size_t i = 0; i < lamps.lamps.size(); ++i) {
    for (std::size_t j = i + 1; j < lamps.lamps.size(); ++j) {
      const Lamp &a = lamps.lamps[i], &b = lamps.lamps[j];
      if (!a.frequency_hz || !b.frequency_hz) continue;
      if (!have_similar_duties(a, b)) continue;
      const double gap = std::abs(std::log(*a.frequency_hz / *b.frequency_hz));
      const double sd = std::max(predict_lamp_sd(a, conditions), predict_lamp_sd(b, conditions));
      const double needed = kLampDrift + 4 * sd;
      // list_unreadable_lamps() reports lamps without a measurable period.
      if (gap >= needed || !std::isfinite(needed)) continue;
      pairs.push_back({a.id, b.id, std::expm1(gap), std::expm1(needed)});
    }
  }
  return pairs;
}

std::vector<UnreadableLamp> list_unreadable_lamps(const LampMap& lamps,
                                                  const StripeConditions& conditions) {
  std::vector<UnreadableLamp> unreadable;
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) continue;
    const double phase = std::numbers::pi * *lamp.frequency_hz * conditions.exposure_s.value_or(0);
    const double contrast = phase > 0 ? std::abs(std::sin(phase) / phase) : 1;
    const auto lines = count_scanlines(lamp, conditions);
    const double periods = lines ? kUsedHeight * *lines * *lamp.frequency_hz * conditions.row_time_s
                                 : std::numeric_limits<double>::infinity();
    const double period_lines = 1 / (*lamp.frequency_hz * conditions.row_time_s);
    if (period_lines < kMinPeriod_lines || periods < kMinPeriods || contrast < kMinContrast) {
      unreadable.push_back({lamp.id, period_lines, periods, contrast});
    }
  }
  return unreadable;
}

}  // namespace vlp
