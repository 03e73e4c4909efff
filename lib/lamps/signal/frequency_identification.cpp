// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/frequency_identification.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vlp {
namespace {

struct Candidate {
  const Lamp* lamp;
  /// Deviation from the light, in log frequency and in duty.
  double off, duty_off;
};

bool is_closer(const Candidate& a, const Candidate& b) {
  return b.off >= std::max(2 * a.off, a.off + kLampDrift);
}

bool is_better_match(const Candidate& a, const Candidate& b) {
  if (is_closer(a, b)) return true;
  if (is_closer(b, a)) return false;
  return a.lamp->duty && b.lamp->duty && b.duty_off >= a.duty_off + kDutyMargin;
}

}  // namespace

std::optional<int> identify_by_frequency(const LampMap& lamps, double row_time_s,
                                         const Stripes& stripes) {
  // Lamps keep their frequency to a few per cent. Few or unclear stripes, for example of partly
  // hidden lamps, require a smaller deviation.
  const double max_off = are_stripes_reliable(stripes) ? 0.06 : kMaxUnclearDrift;
  if (!are_stripes_readable(stripes) || !(stripes.period_lines > 0)) return std::nullopt;
  const double frequency_hz = 1 / (stripes.period_lines * row_time_s);
  std::vector<Candidate> candidates;
  candidates.reserve(lamps.lamps.size());
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) continue;
    candidates.push_back({&lamp, std::abs(std::log(frequency_hz / *lamp.frequency_hz)),
                          std::abs(stripes.duty - lamp.duty.value_or(0))});
  }
  for (const Candidate& candidate : candidates) {
    const bool best =
        std::all_of(candidates.begin(), candidates.end(), [&](const Candidate& other) {
          return &other == &candidate || is_better_match(candidate, other);
        });
    if (best && candidate.off < max_off) return candidate.lamp->id;
  }
  return std::nullopt;
}

}  // namespace vlp
