// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/stripes.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace vlp {

namespace {

constexpr double kMinPeriodicity = 0.7;

/// Values of four frequencies, for vector instructions.
using Lanes = Eigen::Array4d;

/// Returns the fraction of the variance that a sine of each frequency (per line) and a constant
/// explain.
Lanes compute_explained_fraction(const std::vector<double>& signal, double mean, double variance,
                                 const Lanes& frequencies) {
  const Lanes step = 2 * std::numbers::pi * frequencies;
  const Lanes turn_c = step.cos(), turn_s = step.sin();
  Lanes c = Lanes::Ones(), s = Lanes::Zero();
  const Lanes none = Lanes::Zero();
  Lanes sum_c = none, sum_s = none, sum_cc = none, sum_cs = none, a = none, b = none;
  for (const double value : signal) {
    sum_c += c;
    sum_s += s;
    sum_cc += c * c - s * s;
    sum_cs += 2 * c * s;
    a += (value - mean) * c;
    b += (value - mean) * s;
    const Lanes next = c * turn_c - s * turn_s;
    s = c * turn_s + s * turn_c;
    c = next;
  }
  const auto n = static_cast<double>(signal.size());
  // Normal equations of cosine and sine after elimination of the constant.
  const Lanes cc = (n + sum_cc) / 2 - sum_c * sum_c / n;
  const Lanes ss = (n - sum_cc) / 2 - sum_s * sum_s / n;
  const Lanes cs = sum_cs / 2 - sum_c * sum_s / n;
  const Lanes determinant = cc * ss - cs * cs;
  const Lanes fraction = (ss * a * a - 2 * cs * a * b + cc * b * b) / determinant / (n * variance);
  return (determinant > 1e-6 * n * n).select(fraction, 0);
}

/// Returns the positions of the begins or ends of stripes, where the signal crosses the middle
/// between dark and bright.
std::vector<double> list_crossings(const std::vector<double>& signal, double middle, bool rising) {
  std::vector<double> places;
  for (std::size_t i = 1; i < signal.size(); ++i) {
    const double before = signal[i - 1] - middle, after = signal[i] - middle;
    if ((rising && before < 0 && after >= 0) || (!rising && before >= 0 && after < 0)) {
      places.push_back(double(i) - after / (after - before));
    }
  }
  return places;
}

/// Fits the period to the begins and ends of stripes by least squares: one offset for the begins,
/// one for the ends. Exact for square waves, where few periods bias a sine fit. Returns
/// std::nullopt if there are too few or if they do not agree with `guess`.
std::optional<double> fit_to_crossings(const std::vector<double>& signal, double middle,
                                       double guess) {
  // Number and position of each crossing, relative to their means over the begins or the ends.
  std::vector<Eigen::Vector2d> points;
  for (const bool rising : {true, false}) {
    const std::vector<double> places = list_crossings(signal, middle, rising);
    if (places.size() < 2) continue;
    const std::size_t first = points.size();
    Eigen::Vector2d point(0, places[0]), mean = Eigen::Vector2d::Zero();
    for (const double place : places) {
      if (place > places[0]) point[0] += std::max(1.0, std::round((place - point[1]) / guess));
      point[1] = place;
      points.push_back(point);
      mean += point / double(places.size());
    }
    for (std::size_t i = first; i < points.size(); ++i) points[i] -= mean;
  }
  double moment = 0, square = 0, squared_residuals = 0;
  for (const Eigen::Vector2d& point : points) {
    moment += point[0] * point[1];
    square += point[0] * point[0];
  }
  if (!(square > 0)) return std::nullopt;
  const double period = moment / square;
  for (const Eigen::Vector2d& point : points) {
    squared_residuals += std::pow(point[1] - period * point[0], 2);
  }
  constexpr double max_residual = 0.12, max_off = 0.35;
  const bool in_time = std::sqrt(squared_residuals / double(points.size())) < max_residual * period;
  if (!in_time || std::abs(period / guess - 1) > max_off) return std::nullopt;
  return period;
}

/// Returns the fraction of the disc's area on scanlines brighter than `middle`, for chords in the
/// middle of the disc.
double compute_lit_fraction(const std::vector<double>& signal, double middle) {
  const auto n = static_cast<double>(signal.size());
  double lit = 0, all = 0;
  for (std::size_t i = 0; i < signal.size(); ++i) {
    const double off = kUsedHeight * (2 * (double(i) + 0.5) / n - 1);
    const double chord = std::sqrt(1 - off * off);
    all += chord;
    if (signal[i] > middle) lit += chord;
  }
  return lit / all;
}

}  // namespace

bool are_stripes_reliable(const Stripes& stripes) {
  return stripes.periodicity_r2 > kMinPeriodicity && stripes.periods > kMinReliablePeriods;
}

bool are_stripes_readable(const Stripes& stripes) {
  return stripes.is_regular || stripes.periodicity_r2 > kMinPeriodicity;
}

Stripes measure_stripes(const std::vector<double>& signal) {
  constexpr std::size_t min_lines = 8;
  if (signal.size() < min_lines) return {};
  const auto n = static_cast<double>(signal.size());
  std::vector<double> sorted = signal;
  std::sort(sorted.begin(), sorted.end());
  const double low = std::max(0.0, sorted[sorted.size() / 20]);
  const double high = sorted[sorted.size() - 1 - sorted.size() / 20];
  if (!(high > 0)) return {};
  Stripes stripes{};
  stripes.contrast = (high - low) / high;
  double mean = 0, variance = 0;
  for (const double value : signal) mean += value / n;
  for (const double value : signal) variance += (value - mean) * (value - mean) / n;
  constexpr double rounding = 1e-18;
  if (!(high > low) || !(variance > rounding * high * high)) return stripes;

  // The step is sufficiently small for a parabola through the best three values.
  const double step = 0.2 / n, lowest = 0.9 / n, highest = 1 / kMinPeriod_lines;
  const Lanes steps(0, step, 2 * step, 3 * step);
  double best = lowest;
  for (double first = lowest; first <= highest; first += 4 * step) {
    const Lanes fractions = compute_explained_fraction(signal, mean, variance, first + steps);
    for (Eigen::Index i = 0; i < 4 && first + steps[i] <= highest; ++i) {
      if (fractions[i] > stripes.periodicity_r2)
        stripes.periodicity_r2 = fractions[i], best = first + steps[i];
    }
  }
  const Lanes neighbors = compute_explained_fraction(signal, mean, variance, best - step + steps);
  const double before = neighbors[0], after = neighbors[2];
  const double curvature = before - 2 * stripes.periodicity_r2 + after;
  if (curvature < 0) best += std::clamp((before - after) / curvature / 2, -1.0, 1.0) * step;
  const double middle = (low + high) / 2;
  const auto in_time = fit_to_crossings(signal, middle, 1 / best);
  stripes.is_regular = in_time.has_value();
  stripes.period_lines = in_time.value_or(1 / best);
  stripes.periods = n / stripes.period_lines;
  // The duty is measured over whole periods.
  const double used = std::max(1.0, std::floor(stripes.periods)) * stripes.period_lines;
  double lit = 0;
  for (std::size_t i = 0; i < signal.size(); ++i) {
    lit += std::clamp(used - double(i), 0.0, 1.0) * signal[i];
  }
  stripes.duty = std::clamp((lit / std::min(used, n) - low) / (high - low), 0.0, 1.0);
  const std::size_t edges =
      list_crossings(signal, middle, true).size() + list_crossings(signal, middle, false).size();
  stripes.count_per_line = static_cast<double>(edges) / (2 * n);
  stripes.lit_area = compute_lit_fraction(signal, middle);
  return stripes;
}

namespace {

/// Levels of five parts of a scanline.
using PartLevels = Eigen::Array<double, 5, 1>;

/// Returns the mean levels of the parts of each chord above `dark`.
std::vector<PartLevels> measure_parts(const ImageView& image, const std::vector<PixelRun>& chords,
                                      double dark) {
  constexpr int parts = PartLevels::SizeAtCompileTime;
  std::vector<PartLevels> levels;
  levels.reserve(chords.size());
  for (const PixelRun& chord : chords) {
    PartLevels& line = levels.emplace_back();
    for (int part = 0; part < parts; ++part) {
      const int from = chord.begin + chord.pixel_run_width_px() * part / parts;
      const int to =
          std::max(from + 1, chord.begin + chord.pixel_run_width_px() * (part + 1) / parts);
      line[part] = mean_level(image, {chord.row, from, to}) - dark;
    }
  }
  return levels;
}

}  // namespace

std::vector<PixelRun> list_chords_in_ellipse(const Eigen::Vector2d& low,
                                             const Eigen::Vector2d& high, const ImageSize& size) {
  constexpr double used_width = 0.8;
  const Eigen::Vector2d center = (low + high) / 2, half = (high - low) / 2;
  const int first = std::max(0, static_cast<int>(std::ceil(center.y() - kUsedHeight * half.y())));
  const int last =
      std::min(size.height - 1, static_cast<int>(std::floor(center.y() + kUsedHeight * half.y())));
  std::vector<PixelRun> chords;
  for (int row = first; row <= last; ++row) {
    const double off = (row - center.y()) / half.y();
    const double used = used_width * half.x() * std::sqrt(std::max(0.0, 1 - off * off));
    const int begin = std::max(0, static_cast<int>(std::lround(center.x() - used)));
    const int end = std::min(size.width, static_cast<int>(std::lround(center.x() + used)) + 1);
    if (begin < end) chords.push_back({row, begin, end});
  }
  return chords;
}

std::vector<double> compute_scanline_signal(const ImageView& image,
                                            const std::vector<PixelRun>& chords, double dark,
                                            bool has_bright_core) {
  std::vector<double> signal;
  signal.reserve(chords.size());
  for (PartLevels& parts : measure_parts(image, chords, dark)) {
    std::sort(parts.begin(), parts.end());
    signal.push_back(parts[has_bright_core ? 1 : 3]);
  }
  return signal;
}

double measure_part_coherence(const ImageView& lines, const std::vector<PixelRun>& chords,
                              const Background& background, double period_lines) {
  constexpr double fraction = 0.05;
  constexpr std::size_t min_values = 3;
  const std::vector<PartLevels> levels = measure_parts(lines, chords, background.level);
  const auto quarter = static_cast<std::size_t>(std::max(1L, std::lround(period_lines / 4)));
  if (levels.size() + 1 < min_values + 2 * quarter) return 0;
  double brightest = 0;
  std::vector<PartLevels> sums{PartLevels::Zero()};  // cumulative
  sums.reserve(levels.size() + 1);
  for (const PartLevels& line : levels) {
    sums.emplace_back(sums.back() + line);
    brightest = std::max(brightest, line.mean());
  }
  const double soft = (background.threshold - background.level) / 2 + fraction * brightest;
  PartLevels cross_sums = PartLevels::Zero(), own_squares = cross_sums, other_squares = cross_sums;
  for (std::size_t line = quarter; line + quarter <= levels.size(); ++line) {
    const PartLevels before = (sums[line] - sums[line - quarter]) / double(quarter);
    const PartLevels after = (sums[line + quarter] - sums[line]) / double(quarter);
    const PartLevels step = ((after.max(0) + soft) / (before.max(0) + soft)).log();
    const PartLevels other_parts = step.sum() - step;
    cross_sums += step * other_parts;
    own_squares += step.square();
    other_squares += other_parts.square();
  }
  const PartLevels scales = (own_squares * other_squares).sqrt();
  PartLevels coherences = (scales > 0).select(cross_sums / scales, 0);
  std::sort(coherences.begin(), coherences.end());
  return coherences[1];
}

}  // namespace vlp
