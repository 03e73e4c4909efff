// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/background.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace vlp {
namespace {

/// Number of pixels of each level.
class Histogram {
 public:
  explicit Histogram(int levels) : counts_(static_cast<std::size_t>(levels), 0) {}

  void add(int level) {
    ++counts_[static_cast<std::size_t>(level)];
    ++count_;
    highest_ = std::max(highest_, level);
  }
  int count_samples() const { return count_; }
  int count_levels_within(double low, double high) const {
    int sum = 0;
    for_each([&](int level, int count) { sum += level >= low && level <= high ? count : 0; });
    return sum;
  }
  /// Returns the level of the pixel with this rank in ascending order.
  int level_at(int rank) const {
    int level = 0;
    for (int passed = counts_[0]; passed <= rank; passed += counts_[std::size_t(level)]) ++level;
    return level;
  }
  /// Calls `function` for each level that occurs, in ascending order.
  template <typename Function>
  void for_each(Function&& function) const {
    for (int level = 0; level <= highest_; ++level) {
      const int count = counts_[static_cast<std::size_t>(level)];
      if (count > 0) function(level, count);
    }
  }

 private:
  std::vector<int> counts_;
  int count_ = 0, highest_ = 0;
};

/// Calls `function` for a sample of the pixels, with the level of the pixel and the mean level of
/// `width_px` pixels of its row from it on.
template <typename Function>
void for_each_sample(const ImageView& image, int width_px, Function&& function) {
  constexpr double sufficient_count = 8000;
  const double pixels = static_cast<double>(image.height) * image.width;
  // An odd step that shifts from row to row samples all rows and columns of a periodic pattern.
  const int step = static_cast<int>(std::sqrt(pixels / sufficient_count)) | 1;
  for (int row = std::min(step / 2, image.height / 2); row < image.height; row += step) {
    for (int column = row / step % step; column + width_px <= image.width; column += step) {
      const int level = image.gray_level_at_pixel(column, row);
      int sum = level;
      for (int i = 1; i < width_px; ++i) sum += image.gray_level_at_pixel(column + i, row);
      function(level, sum / width_px);
    }
  }
}

/// Returns the smallest difference between two levels: above 1 for images of 12 bits in 16, or of 8
/// in 16. Returns 1 if few levels occur, which do not determine it.
double get_level_step(const Histogram& sample) {
  constexpr int sufficient_count = 16;
  int step = std::numeric_limits<int>::max(), levels = 0, before = 0;
  sample.for_each([&](int level, int) {
    if (levels++ > 0) step = std::min(step, level - before);
    before = level;
  });
  return levels >= sufficient_count ? step : 1;
}

/// Returns true if noise below the median is clipped at the smallest level. The median is then the
/// smallest level, and noise fills the levels next to it more than those that 10 % of the pixels
/// exceed. Lit pixels do not have this distribution, and a noiseless dark level has nothing below
/// it either.
bool is_noise_clipped(const Histogram& sample, int median, double step) {
  const int tenth =
      sample.level_at(static_cast<int>(std::int64_t{sample.count_samples()} * 9 / 10));
  const double next = median + std::max(step, (tenth - median) / 2.0);
  const double max_level = std::numeric_limits<int>::max();
  const int below = sample.count_levels_within(0, median - 1);
  const int above = sample.count_levels_within(median + 1, max_level);
  const int near = sample.count_levels_within(median + 1, next);
  return 4 * below < above && 10 * near >= above;
}

/// Estimates the noise from the pixels above the median. 20 % of them are brighter than 0.84
/// standard deviations, and 10 % than 1.28. If this many pixels are lit, the estimate is too large,
/// so the smaller one is used.
double estimate_noise_above(const Histogram& sample, int median) {
  const auto above = [&](int per_cent) {
    const auto rank = std::int64_t{sample.count_samples()} * per_cent / 100;
    return double(sample.level_at(static_cast<int>(rank)) - median);
  };
  return std::min(above(80) / 0.8416, above(90) / 1.2816);
}

/// Returns the highest level of the darker of two classes, between which the variance is largest
/// (Otsu 1979).
int compute_max_dark_level(const Histogram& sample) {
  const double count = sample.count_samples();
  double sum = 0, dark_sum = 0, dark_count = 0, largest = -1;
  int max_dark_level = 0;
  sample.for_each([&](int level, int pixels) { sum += double(level) * pixels; });
  sample.for_each([&](int level, int pixels) {
    dark_count += pixels;
    dark_sum += double(level) * pixels;
    const double between = std::pow(dark_sum * count - dark_count * sum, 2) /
                           (dark_count * std::max(1.0, count - dark_count));
    if (between > largest) largest = between, max_dark_level = level;
  });
  return max_dark_level;
}

Background estimate_background(const Histogram& sample) {
  const double step = get_level_step(sample);
  const int half = sample.count_samples() / 2, median = sample.level_at(half);
  // Lit pixels are above the median; the pixels below contain only noise.
  double squares = 0;
  sample.for_each([&](int level, int count) {
    if (level < median) squares += count * std::pow(median - level, 2);
  });
  double noise = std::sqrt(squares / std::max(1, half));
  const bool no_noise_below = is_noise_clipped(sample, median, step);
  if (no_noise_below) noise = std::max(noise, estimate_noise_above(sample, median));
  // Gray levels are coarse: mean and scatter of the surrounding levels are more precise.
  constexpr double around = 3;
  const double min_noise = 0.3 * step;
  double near = 0, sum = 0, sum_of_squares = 0;
  sample.for_each([&](int level, int count) {
    const double off = level - median;
    if (std::abs(off) > around * noise) return;
    near += count;
    sum += count * off;
    sum_of_squares += count * off * off;
  });
  const double level = median + sum / near;
  if (!no_noise_below) noise = std::sqrt(sum_of_squares / near - std::pow(sum / near, 2));
  noise = std::max(noise, min_noise);
  constexpr double clear = 4.5, min_steps = 1.6;
  return {level, noise, level + std::max(clear * noise, min_steps * step)};
}

}  // namespace

Background estimate_background_of(const ImageView& image) {
  Histogram sample(image.get_max_gray_level() + 1);
  for_each_sample(image, 1, [&](int level, int) { sample.add(level); });
  if (sample.count_samples() == 0) sample.add(image.gray_level_at_pixel(0, 0));
  return estimate_background(sample);
}

std::optional<Background> estimate_dark_background(const ImageView& image) {
  // Means of four pixels average the mosaic of a color filter and most of the noise.
  constexpr int mean_px = 4;
  constexpr int min_lit_per_cent = 5;
  Histogram means(image.get_max_gray_level() + 1), dark_sample = means;
  for_each_sample(image, mean_px, [&](int, int mean) { means.add(mean); });
  if (means.count_samples() == 0) return std::nullopt;
  const int max_dark_level = compute_max_dark_level(means);
  for_each_sample(image, mean_px, [&](int level, int mean) {
    if (mean <= max_dark_level) dark_sample.add(level);
  });
  const Background dark = estimate_background(dark_sample);
  const auto rank = std::int64_t{means.count_samples()} * (100 - min_lit_per_cent) / 100;
  if (means.level_at(static_cast<int>(rank)) <= dark.threshold) return std::nullopt;
  return dark;
}

}  // namespace vlp
