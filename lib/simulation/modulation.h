// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace vlp {

/// A lamp switched by a square wave: lit while frac(frequency t + phase) < duty.
struct SquareWave {
  double frequency_hz;
  double duty;
  double phase;  // in periods

  /// The lit share of the time from begin_s to end_s > begin_s, in closed form.
  double lit_share(double begin_s, double end_s) const;
};

}  // namespace vlp
