// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/line_levels.h"

#include <algorithm>
#include <cmath>

#include "lamps/signal/lamp_map_check.h"
#include "lamps/signal/stripes.h"

namespace vlp {

namespace {

/// Mean of the pixels of a chord above the dark level, and their moment about the middle column.
struct ChordSums {
  double middle, mean, moment, spread;
};

ChordSums sum_chord_levels(const ImageView& lines, const PixelRun& chord, double dark) {
  const double count = chord.pixel_run_width_px(), middle = (chord.begin + chord.end - 1) / 2.0;
  double sum = 0, moment = 0;
  for (int column = chord.begin; column < chord.end; ++column) {
    const double level = lines.gray_level_at_pixel(column, chord.row) - dark;
    sum += level;
    moment += level * (column - middle);
  }
  return {middle, sum / count, moment, count * (count * count - 1) / 12};
}

}  // namespace

LineLevels::LineLevels(const ImageView& lines, const std::vector<PixelRun>& chords,
                       const Background& background)
    : first_(chords.front().row) {
  constexpr double unevenness = 0.005, steepest = 0.01;
  std::vector<ChordSums> sums;
  sums.reserve(chords.size());
  double moment = 0, spread = 0;
  for (const PixelRun& chord : chords) {
    sums.push_back(sum_chord_levels(lines, chord, background.level));
    middle_ += sums.back().middle / double(chords.size());
    moment += sums.back().moment;
    spread += std::max(0.0, sums.back().mean) * sums.back().spread;
  }
  if (spread > 0) slope_ = std::clamp(moment / spread, -steepest, steepest);
  std::vector<double> signal;
  signal.reserve(sums.size());
  for (const ChordSums& line : sums) {
    signal.push_back(std::max(0.0, line.mean / level_at_column_relative_to_middle(line.middle)));
    brightest_ = std::max(brightest_, signal.back());
  }
  if (!(brightest_ > 0)) brightest_ = 1;
  measured_.reserve(signal.size());
  for (std::size_t i = 0; i < signal.size(); ++i) {
    const double noise = background.noise / brightest_ / std::sqrt(chords[i].pixel_run_width_px());
    const double level = signal[i] / brightest_;
    measured_.push_back({level, std::hypot(noise, unevenness * level)});
  }
  const Stripes stripes = measure_stripes(signal);
  if (!(stripes.contrast >= kMinContrast)) return;
  period_lines_ = stripes.period_lines;
  period_sd_ = predict_relative_period_sd(period_lines_, double(signal.size()) / kUsedHeight, 0) *
               period_lines_;
}

std::optional<LineLevel> LineLevels::relative_scanline_level(int line) const {
  const int last = first_ + static_cast<int>(measured_.size()) - 1;
  if (line >= first_ && line <= last) return measured_[static_cast<std::size_t>(line - first_)];
  if (period_lines_ > 0) {
    const LineLevel level = predict_relative_scanline_level(line);
    return level.sd < 1 ? std::optional(level) : std::nullopt;
  }
  constexpr int nearest = 6;
  constexpr double steady_sd = 0.02;
  double sum = 0;
  for (int i = 0; i < nearest; ++i) {
    sum += measured_[static_cast<std::size_t>(line < first_ ? i : last - first_ - i)].level;
  }
  return LineLevel{sum / nearest, steady_sd};
}

LineLevel LineLevels::predict_relative_scanline_level(int line) const {
  constexpr int max_periods = 4;
  // The face may be dimmer near its edge: relative sd with one period, with several; absolute sd.
  constexpr double alone_sd = 0.2, several_sd = 0.05, dark_sd = 0.01;
  constexpr double missed = 1.5;  // interpolation error between two lines at the edge of a stripe
  const int last = first_ + static_cast<int>(measured_.size()) - 1;
  const int sign = line < first_ ? 1 : -1;
  double sum = 0, squares = 0, variance = 0;
  int count = 0;
  for (int k = 1; count < max_periods; ++k) {
    const double at = line + sign * k * period_lines_;
    const int before = static_cast<int>(std::floor(at));
    if (sign > 0 ? before + 2 > last : before - 1 < first_) break;
    if (before - 1 < first_ || before + 2 > last) continue;
    const auto level = [&](int i) {
      return measured_[static_cast<std::size_t>(before + i - first_)].level;
    };
    const double fraction = at - before, value = level(0) + fraction * (level(1) - level(0));
    const double curvature = std::abs(level(-1) - level(0) - level(1) + level(2)) / 2;
    const double slope = level(1) - level(0);
    variance += std::pow(missed * fraction * (1 - fraction) * curvature, 2) +
                std::pow(slope * k * period_sd_, 2) +
                std::pow(measured_[static_cast<std::size_t>(before - first_)].sd, 2);
    sum += value;
    squares += value * value;
    ++count;
  }
  if (count == 0) return {0, 1};
  const double mean = sum / count;
  const double scatter = count > 1 ? std::max(0.0, squares - count * mean * mean) / (count - 1)
                                   : std::pow(alone_sd * mean, 2);
  // Vignetting changes the levels from period to period. They scatter by this change, and their
  // mean has an error of the same size. The scatter is therefore not divided by their number.
  return {mean, std::sqrt(dark_sd * dark_sd + std::pow(several_sd * mean, 2) + variance / count +
                          scatter)};
}

}  // namespace vlp
