// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/random.h"

namespace vlp {

/// Returns the signal of `lines` scanlines on a lamp of this period and duty. The exposure of a
/// scanline is `exposure_lines` line times; `noise` is a fraction of the stripes' height.
inline std::vector<double> noisy_square_wave(int lines, double period, double duty,
                                             double exposure_lines, double noise, Random& random) {
  const auto lit_until = [&](double time) {
    const double whole = std::floor(time / period);
    return whole * duty * period + std::min(time - whole * period, duty * period);
  };
  const double phase = random.uniform(0, period);
  std::vector<double> signal;
  for (int line = 0; line < lines; ++line) {
    const double begin = line + phase;
    const double fraction = (lit_until(begin + exposure_lines) - lit_until(begin)) / exposure_lines;
    signal.push_back(200 * (fraction + noise * random.normal()));
  }
  return signal;
}

}  // namespace vlp
