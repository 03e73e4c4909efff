// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/row_time_error.h"

#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "lamps/signal/lamp_rule.h"

namespace vlp {

std::optional<double> find_true_row_time(std::span<const double> frequencies_hz, const LampMap& map,
                                         double row_time_s) {
  constexpr double frequency_tolerance = 0.01, max_ratio = 1.4, min_fraction = 0.8;
  constexpr std::size_t min_lamps = 3;
  // Any light may be any lamp; the hypothesis that matches most of the other lights counts.
  std::size_t best = 0;
  double best_error = 0, best_ratio = 1;
  for (const double hypothesis_hz : frequencies_hz) {
    for (const Lamp& hypothesis : map.lamps) {
      if (!hypothesis.frequency_hz) continue;
      const double ratio = *hypothesis.frequency_hz / hypothesis_hz;
      if (ratio > max_ratio || ratio < 1 / max_ratio) continue;
      std::set<double> lamps_hz;
      std::size_t matching = 0;
      double sum_of_errors = 0;
      for (const double frequency_hz : frequencies_hz) {
        double smallest = frequency_tolerance, lamp_hz = 0;
        for (const Lamp& lamp : map.lamps) {
          const double error =
              lamp.frequency_hz ? std::abs(ratio * frequency_hz / *lamp.frequency_hz - 1) : 1;
          if (error < smallest) std::tie(smallest, lamp_hz) = std::pair(error, *lamp.frequency_hz);
        }
        if (smallest >= frequency_tolerance) continue;
        ++matching;
        sum_of_errors += smallest;
        lamps_hz.insert(lamp_hz);
      }
      const bool is_better = matching > best || (matching == best && sum_of_errors < best_error);
      if (lamps_hz.size() < min_lamps || !is_better) continue;
      std::tie(best, best_error, best_ratio) = std::tuple(matching, sum_of_errors, ratio);
    }
  }
  const auto lights = static_cast<double>(frequencies_hz.size());
  const bool most_match = best > 0 && static_cast<double>(best) >= min_fraction * lights;
  if (!most_match || std::abs(best_ratio - 1) <= kMaxUnclearDrift) return std::nullopt;
  return row_time_s / best_ratio;
}

}  // namespace vlp
