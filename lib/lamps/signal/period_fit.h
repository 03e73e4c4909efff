// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace vlp {

/// Brightness of a light along the read-out.
struct LineProfile {
  double first_line;  ///< middle of the first bin, as a line of the image
  int lines_per_bin;
  std::vector<double> levels;  ///< above the dark level, of any scale
};

/// Fit of a periodic signal to a profile.
struct PeriodFit {
  double period_lines;
  /// Fraction of the variance of the normalized profile that the signal leaves, 0 to 1.
  double unexplained = 1;
  /// Amplitude of the fundamental over the mean: 4 / pi for a square wave of duty 0.5.
  double depth = 0;
  /// Phase p of the fundamental, cos(2 pi line / period - p), in rad.
  double phase_rad = 0;
  /// Periods that the lit lines cover.
  double periods = 0;
};

/// Fits a signal of one period behind a smooth envelope to a profile.
///
/// The envelope E is the moving mean of the profile over exactly one period, twice; at the ends of
/// the profile over the available lines. It contains everything slower than the period and nothing
/// of the period and its harmonics, so that
///
///     y(l) / E(l) - 1 = sum_h c_h cos(2 pi h l / P) + s_h sin(2 pi h l / P),   h = 1, 2, 3,
///
/// whatever the shape of the light. The coefficients are those of weighted least squares with the
/// weights E(l); lines count where E exceeds 8 % of its maximum. A period that is longer than the
/// lit lines fits most signals: it cannot be excluded. Returns a fit that leaves all of the
/// variance if the lines do not determine the coefficients.
PeriodFit fit_period(const LineProfile& profile, double period_lines);

/// Divides a profile by its envelope for that period, see fit_period(), where it has light: the
/// brightest lines are about 1 / duty, one value for each line.
std::vector<double> divide_by_envelope(const LineProfile& profile, double period_lines);

/// Fits all periods from `min_period_lines` on, up to the one that the profile shows 1.3 times, and
/// returns the best. Periods of less than a hundredth of the profile are left out.
PeriodFit find_period(const LineProfile& profile, double min_period_lines);

}  // namespace vlp
