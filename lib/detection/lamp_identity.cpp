// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "detection/lamp_detector.h"

namespace vlp {

std::optional<int> LampDetector::lamp_of(const Stripes& stripes) const {
  // Lamps keep their frequency to a few per cent. Few stripes, and unclear ones, where something
  // hides a part, have to fit better.
  constexpr double clear = 0.7, many = 2.5;
  const bool sure = stripes.clarity > clear && stripes.periods > many;
  const double most_off = sure ? 0.06 : 0.025;
  if (!camera_.row_time_s || !(stripes.period_lines > 0)) return std::nullopt;
  if (!stripes.regular && stripes.clarity <= clear) return std::nullopt;
  const double frequency_hz = 1 / (stripes.period_lines * *camera_.row_time_s);
  double best = most_off, second = std::numeric_limits<double>::infinity();
  std::optional<int> id;
  for (const Lamp& lamp : lamps_.lamps) {
    if (!lamp.frequency_hz) continue;
    const double off = std::abs(std::log(frequency_hz / *lamp.frequency_hz));
    if (off < best) {
      second = best < most_off ? best : second;
      best = off, id = lamp.id;
    } else {
      second = std::min(second, off);
    }
  }
  // Lamps drift: a lamp has to be nearer than any other by this much.
  constexpr double drift = 0.015;
  if (id && second < std::max(2 * best, best + drift)) return std::nullopt;
  return id;
}

void LampDetector::identify(std::vector<Light>& lights, const cv::Size& size) const {
  constexpr double least_contrast = 0.2, least_clarity = 0.5, least_periods = 1.3;
  constexpr double much_softer = 5, least_roundness = 0.45, most_outside = 0.25;
  double sharpest_px = std::numeric_limits<double>::infinity();
  for (Light& light : lights) {
    const Stripes& stripes = light.stripes;
    const bool flickers = stripes.contrast >= least_contrast && stripes.periods >= least_periods &&
                          stripes.clarity >= least_clarity;
    light.kind = flickers ? LightKind::unknown : LightKind::steady;
    if (!flickers) continue;
    sharpest_px = std::min(sharpest_px, light.rise_px);
    light.lamp = lamp_of(stripes);
  }
  for (Light& light : lights) {
    // A lamp's reflection flickers like the lamp. Where most of the edge is not the lamp's, a
    // circle through the rest is not to be trusted.
    const bool soft = light.rise_px > much_softer * sharpest_px;
    const bool strays = light.outside > most_outside;
    if (soft || strays || light.roundness < least_roundness) light.lamp.reset();
  }
  // Of two lights with one identity the one with the surer centre has it.
  for (const Lamp& lamp : lamps_.lamps) {
    std::vector<Light*> claims;
    for (Light& light : lights) {
      if (light.lamp == lamp.id) claims.push_back(&light);
    }
    const auto best = std::min_element(claims.begin(), claims.end(),
                                       [](auto* a, auto* b) { return a->sigma_px < b->sigma_px; });
    for (Light* claim : claims) {
      if (claim != *best) claim->lamp.reset();
    }
  }
  for (Light& light : lights) {
    if (!light.lamp) continue;
    const bool inside = light.low.minCoeff() > -0.5 && light.high.x() < size.width - 0.5 &&
                        light.high.y() < size.height - 0.5;
    light.kind = inside ? LightKind::lamp : LightKind::cut;
  }
}

}  // namespace vlp
