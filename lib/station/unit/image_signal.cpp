// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/image_signal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace vlp {
namespace {

/// Of a pixel, in levels.
double noise_of(const cv::Mat& image) {
  // Its squares sum to 36: of independent pixels the differences have six times their deviation.
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  constexpr double six = 6;
  cv::Mat differences;
  cv::filter2D(image, differences, CV_32F, kernel);
  const double mean = cv::mean(cv::abs(differences))[0];
  const double rounding = 1 / std::sqrt(12.0);
  return std::max(rounding, std::sqrt(std::numbers::pi / 2) * mean / six);
}

/// The darkest and the brightest median of a pixel and its neighbours on both sides.
std::pair<double, double> extremes(const cv::Mat& image, const cv::Point& side) {
  if (image.cols < 3 || image.rows < 3) return {0, 0};
  const cv::Rect inner(side, cv::Size(image.cols - 2 * side.x, image.rows - 2 * side.y));
  const cv::Mat before = image(inner - side), here = image(inner), after = image(inner + side);
  const cv::Mat low = cv::min(before, here), high = cv::max(before, here);
  const cv::Mat median = cv::max(low, cv::min(high, after));
  double dark = 0, bright = 0;
  cv::minMaxLoc(median, &dark, &bright);
  return {dark, bright};
}

}  // namespace

ImageSignal image_signal(const cv::Mat& image) {
  constexpr double full_8 = 255, full_16 = 65535;
  const auto [dark_along, bright_along] = extremes(image, {1, 0});
  const auto [dark_across, bright_across] = extremes(image, {0, 1});
  const double dark = std::min(dark_along, dark_across);
  const double bright = std::max(bright_along, bright_across);
  return {dark / (image.depth() == CV_8U ? full_8 : full_16), (bright - dark) / noise_of(image)};
}

}  // namespace vlp
