// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace vlp {

/// Brightness of a light as a function of the scanline, in bins of `lines_per_bin` scanlines.
struct LineProfile {
  double first_line;  ///< middle of the first bin, as a scanline of the image
  int lines_per_bin;
  std::vector<double> levels;  ///< levels above the dark level, in any unit
};

/// Fit of a periodic signal (three harmonics) to a LineProfile, by fit_periodic_signal().
/// `period_lines` is the period in scanlines.
struct PeriodFit {
  double period_lines;
  /// Fraction of the variance of the normalized profile that the fit does not explain, 0 to 1.
  double unexplained_fraction = 1;
  /// Ratio of the amplitude of the fundamental to the mean: 4 / pi for a square wave of duty 0.5.
  double depth = 0;
  /// Phase p of the fundamental, cos(2 pi line / period - p), in rad.
  double phase_rad = 0;
  /// Number of periods that the lit scanlines cover.
  double periods = 0;
};

/// Fits a periodic signal with a smooth envelope to a profile.
///
/// The envelope E is the moving mean of the profile over exactly one period, applied twice; at the
/// ends of the profile it is the mean of the available scanlines. It contains all components slower
/// than the period, but not the period and its harmonics. Therefore
///
///     y(l) / E(l) - 1 = sum_h c_h cos(2 pi h l / P) + s_h sin(2 pi h l / P),   h = 1, 2, 3,
///
/// whatever the shape of the light. The coefficients follow from least squares with the weights
/// E(l), over scanlines where E exceeds 8 % of its maximum. A period longer than the lit scanlines
/// fits most signals and cannot be excluded. Returns a fit with `unexplained_fraction` 1 if the
/// scanlines do not determine the coefficients.
PeriodFit fit_periodic_signal(const LineProfile& profile, double period_lines);

/// Divides a profile by its envelope for this period, see fit_periodic_signal(). Returns one value
/// for each scanline with sufficient light; the brightest are about 1 / duty.
std::vector<double> divide_by_envelope(const LineProfile& profile, double period_lines);

/// Fits all periods that differ from `period_lines` by at most the fraction `max_drift`, and
/// returns the best fit.
PeriodFit fit_period_near(const LineProfile& profile, double period_lines, double max_drift);

/// Fits all periods from `min_period_lines` up to that of which the profile shows 1.3 periods, and
/// returns the best fit. Skips periods of less than a hundredth of the profile.
PeriodFit fit_best_period(const LineProfile& profile, double min_period_lines);

}  // namespace vlp
