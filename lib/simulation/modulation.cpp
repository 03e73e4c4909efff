// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/modulation.h"

#include <algorithm>
#include <cmath>

namespace vlp {

double SquareWave::lit_share(double begin_s, double end_s) const {
  const auto lit_periods_until = [&](double t_s) {
    const double periods = frequency_hz * t_s + phase;
    const double whole = std::floor(periods);
    return whole * duty + std::min(periods - whole, duty);
  };
  return (lit_periods_until(end_s) - lit_periods_until(begin_s)) /
         (frequency_hz * (end_s - begin_s));
}

}  // namespace vlp
