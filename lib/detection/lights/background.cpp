// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights/background.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace vlp {
namespace {

template <typename Level>
std::vector<Level> sample_of(const cv::Mat& image) {
  constexpr double enough = 8000;
  const double pixels = static_cast<double>(image.rows) * image.cols;
  // An odd step that shifts from row to row meets every kind of row and column.
  const int step = static_cast<int>(std::sqrt(pixels / enough)) | 1;
  std::vector<Level> sample;
  sample.reserve(static_cast<std::size_t>(2 * enough));
  for (int row = std::min(step / 2, image.rows / 2); row < image.rows; row += step) {
    const auto* line = image.ptr<Level>(row);
    for (int column = row / step % step; column < image.cols; column += step) {
      sample.push_back(line[column]);
    }
  }
  if (sample.empty()) sample.push_back(*image.ptr<Level>(0));
  return sample;
}

/// The least difference between two levels: of 12 bits in 16, or of 8, it is more than 1. Few
/// levels do not tell.
template <typename Level>
double step_of(std::vector<Level> sample) {
  constexpr int enough = 16;
  std::sort(sample.begin(), sample.end());
  double step = std::numeric_limits<Level>::max();
  int levels = 1;
  for (std::size_t i = 1; i < sample.size(); ++i) {
    if (sample[i] == sample[i - 1]) continue;
    ++levels;
    step = std::min<double>(step, sample[i] - sample[i - 1]);
  }
  return levels >= enough ? step : 1;
}

/// Whether levels below the median are missing, because it is the least there is: with noise, which
/// fills the levels next to the dark more than those that one pixel of ten is above. What is lit
/// does not, and a dark without noise has nothing below, either.
template <typename Level>
bool clipped(std::vector<Level>& sample, double median, double step) {
  const auto tenth = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() * 9 / 10);
  std::nth_element(sample.begin(), tenth, sample.end());
  const double next = median + std::max(step, (*tenth - median) / 2);
  const auto below =
      std::count_if(sample.begin(), sample.end(), [&](Level v) { return v < median; });
  const auto above =
      std::count_if(sample.begin(), sample.end(), [&](Level v) { return v > median; });
  const auto near =
      std::count_if(sample.begin(), sample.end(), [&](Level v) { return v > median && v <= next; });
  return 4 * below < above && 10 * near >= above;
}

/// One pixel of five is brighter than 0.84 standard deviations, and one of ten than 1.28; or, if
/// so many are lit, much brighter.
template <typename Level>
double noise_above(std::vector<Level>& sample, double median) {
  const auto above = [&](std::size_t per_cent) {
    const auto at = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() * per_cent / 100);
    std::nth_element(sample.begin(), at, sample.end());
    return *at - median;
  };
  return std::min(above(80) / 0.8416, above(90) / 1.2816);
}

template <typename Level>
Background background(const cv::Mat& image) {
  std::vector<Level> sample = sample_of<Level>(image);
  const double step = step_of(sample);
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  const double median = *middle;
  // Lit pixels are above; what is below is noise alone.
  double squares = 0;
  for (auto below = sample.begin(); below != middle; ++below) {
    squares += (median - *below) * (median - *below);
  }
  double noise = std::sqrt(squares / double(std::max<std::ptrdiff_t>(1, middle - sample.begin())));
  const bool no_noise_below = clipped(sample, median, step);
  if (no_noise_below) noise = std::max(noise, noise_above(sample, median));
  // Grey levels are coarse: of those around, the mean and the scatter say more.
  constexpr double around = 3;
  const double least_noise = 0.3 * step;
  double count = 0, sum = 0, sum_of_squares = 0;
  for (const Level value : sample) {
    const double off = value - median;
    if (std::abs(off) > around * noise) continue;
    ++count;
    sum += off;
    sum_of_squares += off * off;
  }
  const double level = median + sum / count;
  if (!no_noise_below) noise = std::sqrt(sum_of_squares / count - std::pow(sum / count, 2));
  noise = std::max(noise, least_noise);
  constexpr double clear = 4.5, least = 1.6;
  return {level, noise, level + std::max(clear * noise, least * step)};
}

}  // namespace

Background background_of(const cv::Mat& image) {
  return image.depth() == CV_8U ? background<std::uint8_t>(image)
                                : background<std::uint16_t>(image);
}

}  // namespace vlp
