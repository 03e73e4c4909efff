// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/background.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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

template <typename Level>
Background background(const cv::Mat& image) {
  std::vector<Level> sample = sample_of<Level>(image);
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  const double median = *middle;
  // Lit pixels are above; what is below is noise alone.
  double squares = 0;
  for (auto below = sample.begin(); below != middle; ++below) {
    squares += (median - *below) * (median - *below);
  }
  const double noise = std::max(
      0.3, std::sqrt(squares / double(std::max<std::ptrdiff_t>(1, middle - sample.begin()))));
  constexpr double clear = 6, least = 2.5;
  return {median, noise, median + std::max(clear * noise, least)};
}

}  // namespace

Background background_of(const cv::Mat& image) {
  return image.depth() == CV_8U ? background<std::uint8_t>(image)
                                : background<std::uint16_t>(image);
}

}  // namespace vlp
