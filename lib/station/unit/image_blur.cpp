// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/image_blur.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vlp {
namespace {

/// The value that this share of the pixels stays below.
double quantile(const cv::Mat1f& values, double share) {
  std::vector<float> sorted(values.begin(), values.end());
  const auto at =
      sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  return double(*at);
}

}  // namespace

ImageBlur image_blur(const cv::Mat& image) {
  constexpr double full_8 = 255, full_16 = 65535;
  constexpr double smoothing_px = 1;  // against noise; its variance is subtracted below
  // The difference over two pixels averages the rise over them: a blur by a box 2 px wide.
  constexpr double difference_px2 = 4.0 / 12;
  cv::Mat1f levels, smooth, along_x, along_y, rise;
  image.convertTo(levels, CV_32F, 1 / (image.depth() == CV_8U ? full_8 : full_16));
  cv::GaussianBlur(levels, smooth, {}, smoothing_px);
  const double bright = quantile(smooth, 0.99), dark = quantile(smooth, 0.01);
  cv::Scharr(smooth, along_x, CV_32F, 1, 0, 1.0 / 32);
  cv::Scharr(smooth, along_y, CV_32F, 0, 1, 1.0 / 32);
  cv::magnitude(along_x, along_y, rise);
  const double steepest = quantile(rise, 0.999);
  constexpr double least_contrast = 0.02;
  if (bright - dark < least_contrast || steepest <= 0) {
    return {std::numeric_limits<double>::infinity(), bright};
  }
  const double sigma_px = (bright - dark) / (steepest * std::sqrt(2 * std::numbers::pi));
  const double variance_px2 = sigma_px * sigma_px - smoothing_px * smoothing_px - difference_px2;
  return {std::sqrt(std::max(0.0, variance_px2)), bright};
}

}  // namespace vlp
