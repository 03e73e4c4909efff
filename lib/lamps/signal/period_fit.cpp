// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/period_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "geometry/normal_equations.h"

namespace vlp {
namespace {

constexpr int kHarmonics = 3;
/// Minimum envelope of a scanline with sufficient light, as a fraction of the envelope's maximum.
constexpr double kMinEnvelope = 0.08;

/// Returns the mean over `length` bins around each bin, over the available bins.
std::vector<double> compute_moving_mean(const std::vector<double>& values, double length) {
  const auto count = values.size();
  const auto end = double(count);
  std::vector<double> sums(count + 1, 0), means(count);
  for (std::size_t i = 0; i < count; ++i) sums[i + 1] = sums[i] + values[i];
  const auto integral = [&](double t) {
    const auto i = std::min(static_cast<std::size_t>(t), count - 1);
    return sums[i] + (t - double(i)) * values[i];
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double low = std::max(0.0, double(i) + 0.5 - length / 2);
    const double high = std::min(end, double(i) + 0.5 + length / 2);
    means[i] = (integral(high) - integral(low)) / (high - low);
  }
  return means;
}

using HarmonicCoefficients = std::array<double, 2 * kHarmonics>;

/// Returns cos and sin of the harmonics of an angle.
HarmonicCoefficients compute_harmonics(double angle_rad) {
  HarmonicCoefficients basis;
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  basis[0] = c, basis[1] = s;
  for (std::size_t h = 1; h < kHarmonics; ++h) {
    basis[2 * h] = basis[2 * h - 2] * c - basis[2 * h - 1] * s;
    basis[2 * h + 1] = basis[2 * h - 1] * c + basis[2 * h - 2] * s;
  }
  return basis;
}

double multiply_harmonics(const HarmonicCoefficients& a, const HarmonicCoefficients& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Envelope of the profile for a period, in bins, and its maximum.
struct Envelope {
  std::vector<double> levels;
  double largest;

  Envelope(const LineProfile& profile, double period_bins)
      : levels(compute_moving_mean(compute_moving_mean(profile.levels, period_bins), period_bins)),
        largest(*std::max_element(levels.begin(), levels.end())) {}

  /// Returns the weight of a bin, up to 1; 0 if it has too little light.
  double compute_envelope_weight(std::size_t bin) const {
    const double fraction = levels[bin] / largest;
    return fraction < kMinEnvelope ? 0 : fraction;
  }
};

}  // namespace

PeriodFit fit_periodic_signal(const LineProfile& profile, double period_lines) {
  PeriodFit fit{period_lines};
  const double period = period_lines / profile.lines_per_bin;
  if (profile.levels.empty() || !(period > 1)) return fit;
  const Envelope envelope(profile, period);
  if (!(envelope.largest > 0)) return fit;
  Normal<2 * kHarmonics> normal;
  const double step = 2 * std::numbers::pi / period;
  const double start = 2 * std::numbers::pi * profile.first_line / period_lines;
  double squares = 0;
  int lit = 0;
  for (std::size_t i = 0; i < profile.levels.size(); ++i) {
    const double weight = envelope.compute_envelope_weight(i);
    if (weight == 0) continue;
    ++lit;
    const double value = profile.levels[i] / envelope.levels[i] - 1;
    normal.add_residual_row(compute_harmonics(start + step * double(i)), value, weight);
    squares += weight * value * value;
  }
  fit.periods = lit / period;
  if (!(squares > 0)) return fit;
  const Cholesky<2 * kHarmonics> factor(normal);
  if (!factor.has_full_rank(1e-9)) return fit;
  const HarmonicCoefficients coefficients = factor.solve_normal_equations(normal.gradient);
  fit.unexplained_fraction =
      std::clamp(1 - multiply_harmonics(coefficients, normal.gradient) / squares, 0.0, 1.0);
  fit.depth = std::hypot(coefficients[0], coefficients[1]);
  fit.phase_rad = std::atan2(coefficients[1], coefficients[0]);
  return fit;
}

std::vector<double> divide_profile_by_envelope(const LineProfile& profile, double period_lines) {
  std::vector<double> signal;
  if (profile.levels.empty()) return signal;
  const Envelope envelope(profile, period_lines / profile.lines_per_bin);
  if (!(envelope.largest > 0)) return signal;
  for (std::size_t i = 0; i < profile.levels.size(); ++i) {
    if (envelope.compute_envelope_weight(i) == 0) continue;
    const double value = profile.levels[i] / envelope.levels[i];
    signal.insert(signal.end(), std::size_t(profile.lines_per_bin), value);
  }
  return signal;
}

PeriodFit find_best_fitting_period(const LineProfile& profile, double min_period_lines) {
  constexpr double min_periods = 1.3;
  // A fit over N periods loses half of the signal if the period has a relative error of 0.6 / N.
  constexpr double step_fraction = 0.15;
  const double lines = double(profile.levels.size()) * profile.lines_per_bin;
  PeriodFit best;
  best.period_lines = min_period_lines;
  if (profile.levels.empty()) return best;
  constexpr double max_periods = 100;
  const auto improve = [&](double period_lines) {
    const PeriodFit fit = fit_periodic_signal(profile, period_lines);
    if (fit.unexplained_fraction < best.unexplained_fraction) best = fit;
  };
  for (double period = std::max(min_period_lines, lines / max_periods);
       period < lines / min_periods; period *= 1 + step_fraction * period / lines) {
    improve(period);
  }
  for (double step = step_fraction * best.period_lines / lines / 2; step > 1e-4; step /= 2) {
    const double middle = best.period_lines;
    improve(middle * (1 - step));
    improve(middle * (1 + step));
  }
  return best;
}

}  // namespace vlp
