// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/modulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vlp {

double SquareWave::lit_fraction(double begin_s, double end_s) const {
  const auto lit_periods_until = [&](double t_s) {
    const double periods = frequency_hz * t_s + phase;
    const double whole = std::floor(periods);
    return whole * duty + std::min(periods - whole, duty);
  };
  return (lit_periods_until(end_s) - lit_periods_until(begin_s)) /
         (frequency_hz * (end_s - begin_s));
}

double RectifiedSine::lit_fraction(double begin_s, double end_s) const {
  // The integral of |sin(pi x)| from 0 to x grows by 2 / pi for each whole period.
  const auto integral_until = [&](double t_s) {
    const double periods = frequency_hz * t_s + phase;
    const double whole = std::floor(periods);
    return (2 * whole + 1 - std::cos(std::numbers::pi * (periods - whole))) / std::numbers::pi;
  };
  const double mean =
      (integral_until(end_s) - integral_until(begin_s)) / (frequency_hz * (end_s - begin_s));
  return 1 - depth + depth * mean;
}

LightWave with_phase(LightWave wave, double phase) {
  std::visit([&](auto& each) { each.phase = phase; }, wave);
  return wave;
}

}  // namespace vlp
