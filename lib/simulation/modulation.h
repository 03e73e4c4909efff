// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

namespace vlp {

/// Square wave that switches a lamp: lit while frac(frequency t + phase) < duty.
struct SquareWave {
  double frequency_hz;
  double duty;
  double phase;  // in periods

  /// Returns the lit fraction of the time from begin_s to end_s > begin_s, in closed form.
  double lit_fraction(double begin_s, double end_s) const;
};

/// Wave of a light on the mains, as a fraction of its greatest brightness:
///   1 - depth + depth |sin(pi (frequency t + phase))|
/// The frequency is that of the light, twice the mains frequency.
struct RectifiedSine {
  double frequency_hz;
  double depth;
  double phase;  // in periods

  /// Returns the mean over the time from begin_s to end_s > begin_s, in closed form.
  double lit_fraction(double begin_s, double end_s) const;
};

using LightWave = std::variant<SquareWave, RectifiedSine>;

/// Returns the wave with another phase, in periods.
LightWave with_phase(LightWave wave, double phase);

}  // namespace vlp
