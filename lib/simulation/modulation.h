// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

namespace vlp {

/// A lamp switched by a square wave: lit while frac(frequency t + phase) < duty.
struct SquareWave {
  double frequency_hz;
  double duty;
  double phase;  // in periods

  /// The lit share of the time from begin_s to end_s > begin_s, in closed form.
  double lit_share(double begin_s, double end_s) const;
};

/// A light on the mains: of its greatest brightness it gives
///   1 - depth + depth |sin(pi (frequency t + phase))|.
/// The frequency is that of the light, twice that of the mains.
struct RectifiedSine {
  double frequency_hz;
  double depth;
  double phase;  // in periods

  /// Returns the mean over the time from begin_s to end_s > begin_s, in closed form.
  double lit_share(double begin_s, double end_s) const;
};

using LightWave = std::variant<SquareWave, RectifiedSine>;

/// Returns the wave with another phase, in periods.
LightWave with_phase(LightWave wave, double phase);

}  // namespace vlp
