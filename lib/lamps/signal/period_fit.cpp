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

/// Returns the integral of the values from 0 to each bin.
std::vector<double> integrate(const std::vector<double>& values) {
  std::vector<double> sums(values.size() + 1, 0);
  for (std::size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i];
  return sums;
}

/// Returns the mean over `length` bins around each bin, over the available bins, of values of which
/// the integrals are given.
std::vector<double> compute_moving_mean(const std::vector<double>& integrals, double length) {
  const std::size_t count = integrals.size() - 1;
  std::vector<double> means(count);
  const double reach = (1 + length) / 2;
  const auto whole = static_cast<std::size_t>(reach);
  const double fraction = reach - double(whole);
  const auto mean_at_end = [&](std::size_t i) {
    const auto integral = [&](double t) {
      const auto k = std::min(static_cast<std::size_t>(t), count - 1);
      return integrals[k] + (t - double(k)) * (integrals[k + 1] - integrals[k]);
    };
    const double low = std::max(0.0, double(i) + 0.5 - length / 2);
    const double high = std::min(double(count), double(i) + 0.5 + length / 2);
    return (integral(high) - integral(low)) / (high - low);
  };
  const std::size_t inner_end = std::max(whole, count - std::min(count, whole));
  for (std::size_t i = 0; i < std::min(whole, count); ++i) means[i] = mean_at_end(i);
  for (std::size_t i = whole; i < inner_end; ++i) {
    const double *high = integrals.data() + i + whole, *low = integrals.data() + i - whole;
    means[i] = ((1 - fraction) * (high[0] - low[1]) + fraction * (high[1] - low[0])) / length;
  }
  for (std::size_t i = inner_end; i < count; ++i) means[i] = mean_at_end(i);
  return means;
}

using HarmonicCoefficients = std::array<double, 2 * kHarmonics>;

/// Returns cos and sin of the first `harmonics` of an angle of which cos and sin are given; the
/// others are 0.
HarmonicCoefficients compute_harmonics(double c, double s, std::size_t harmonics) {
  HarmonicCoefficients basis{c, s};
  for (std::size_t h = 1; h < harmonics; ++h) {
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

  Envelope(const std::vector<double>& integrals, double period_bins)
      : levels(compute_moving_mean(integrate(compute_moving_mean(integrals, period_bins)),
                                   period_bins)),
        largest(*std::max_element(levels.begin(), levels.end())) {}

  /// Returns the weight of a bin, up to 1; 0 if it has too little light.
  double compute_weight(std::size_t bin) const {
    const double fraction = levels[bin] / largest;
    return fraction < kMinEnvelope ? 0 : fraction;
  }
};

/// Fits a periodic signal to a profile of which the integrals are given.
PeriodFit fit_to_profile(const LineProfile& profile, const std::vector<double>& integrals,
                         double period_lines) {
  PeriodFit fit{period_lines};
  const double period = period_lines / profile.lines_per_bin;
  if (profile.levels.empty() || !(period > 1)) return fit;
  const Envelope envelope(integrals, period);
  if (!(envelope.largest > 0)) return fit;
  Normal<2 * kHarmonics> normal;
  const double step = 2 * std::numbers::pi / period;
  const double start = 2 * std::numbers::pi * profile.first_line / period_lines;
  // Higher harmonics than half a cycle per bin would fit other periods.
  const auto harmonics =
      std::clamp(static_cast<std::size_t>(period / 2), std::size_t(1), std::size_t(kHarmonics));
  for (std::size_t i = 2 * harmonics; i < 2 * kHarmonics; ++i) {
    HarmonicCoefficients unit{};
    unit[i] = 1;
    normal.add_residual_row(unit, 0, 1);
  }
  double squares = 0;
  int lit = 0;
  double c = std::cos(start), s = std::sin(start);
  const double c_step = std::cos(step), s_step = std::sin(step);
  for (std::size_t i = 0; i < profile.levels.size(); ++i) {
    const double weight = envelope.compute_weight(i);
    if (weight > 0) {
      ++lit;
      const double value = profile.levels[i] / envelope.levels[i] - 1;
      normal.add_residual_row(compute_harmonics(c, s, harmonics), value, weight);
      squares += weight * value * value;
    }
    const double next = c * c_step - s * s_step;
    s = s * c_step + c * s_step;
    c = next;
  }
  fit.periods = lit / period;
  if (!(squares > 0)) return fit;
  const Cholesky<2 * kHarmonics> factor(normal);
  if (!factor.has_full_rank(1e-9)) return fit;
  const HarmonicCoefficients coefficients = factor.solve_system(normal.gradient);
  fit.unexplained_fraction =
      std::clamp(1 - multiply_harmonics(coefficients, normal.gradient) / squares, 0.0, 1.0);
  fit.depth = std::hypot(coefficients[0], coefficients[1]);
  fit.phase_rad = std::atan2(coefficients[1], coefficients[0]);
  return fit;
}

/// Returns the best fit of all frequencies in a range, in cycles per scanline: that of a grid,
/// refined to the minimum of the unexplained fraction.
PeriodFit search_frequencies(const LineProfile& profile, double min_frequency,
                             double max_frequency) {
  // A fit over N periods loses half of the signal if the period has a relative error of 0.6 / N.
  constexpr double max_step = 0.2, max_unexplained = 0.9, refinement = 8;
  constexpr int num_refinements = 2;
  const auto integrals = integrate(profile.levels);
  const double lines = double(profile.levels.size()) * profile.lines_per_bin;
  const double range = max_frequency - min_frequency;
  const int num_steps = std::max(1, static_cast<int>(std::ceil(range * lines / max_step)));
  PeriodFit best{2 / (min_frequency + max_frequency)};
  const auto improve = [&](double frequency) {
    const double period_lines = 1 / std::clamp(frequency, min_frequency, max_frequency);
    const PeriodFit fit = fit_to_profile(profile, integrals, period_lines);
    if (fit.unexplained_fraction < best.unexplained_fraction) best = fit;
    return fit.unexplained_fraction;
  };
  double step = range / num_steps;
  for (int i = 0; i < num_steps; ++i) improve(min_frequency + (i + 0.5) * step);
  if (best.unexplained_fraction > max_unexplained) return best;
  step /= 2;
  for (int i = 0; i < num_refinements; ++i, step /= refinement) {
    const double middle = 1 / best.period_lines, unexplained = best.unexplained_fraction;
    const double before = improve(middle - step), after = improve(middle + step);
    // Minimum of the parabola through the three values.
    const double curvature = before - 2 * unexplained + after;
    if (!(curvature > 0)) continue;
    improve(middle + step * std::clamp((before - after) / (2 * curvature), -1.0, 1.0));
  }
  return best;
}

}  // namespace

PeriodFit fit_periodic_signal(const LineProfile& profile, double period_lines) {
  return fit_to_profile(profile, integrate(profile.levels), period_lines);
}

std::vector<double> divide_by_envelope(const LineProfile& profile, double period_lines) {
  std::vector<double> signal;
  if (profile.levels.empty()) return signal;
  const Envelope envelope(integrate(profile.levels), period_lines / profile.lines_per_bin);
  if (!(envelope.largest > 0)) return signal;
  for (std::size_t i = 0; i < profile.levels.size(); ++i) {
    if (envelope.compute_weight(i) == 0) continue;
    const double value = profile.levels[i] / envelope.levels[i];
    signal.insert(signal.end(), std::size_t(profile.lines_per_bin), value);
  }
  return signal;
}

PeriodFit fit_period_near(const LineProfile& profile, double period_lines, double max_drift) {
  if (profile.levels.empty()) return {period_lines};
  return search_frequencies(profile, 1 / (period_lines * (1 + max_drift)),
                            1 / (period_lines * (1 - max_drift)));
}

PeriodFit fit_best_period(const LineProfile& profile, double min_period_lines) {
  constexpr double min_periods = 1.3, max_periods = 100;
  const double lines = double(profile.levels.size()) * profile.lines_per_bin;
  const double shortest = std::max(min_period_lines, lines / max_periods),
               longest = lines / min_periods;
  if (!(shortest < longest)) return {min_period_lines};
  return search_frequencies(profile, 1 / longest, 1 / shortest);
}

}  // namespace vlp
