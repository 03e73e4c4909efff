// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/image_signal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

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

}  // namespace

ImageSignal image_signal(const cv::Mat& image) {
  constexpr double full_8 = 255, full_16 = 65535;
  cv::Mat smooth;
  cv::medianBlur(image, smooth, 3);
  double dark = 0, bright = 0;
  cv::minMaxLoc(smooth, &dark, &bright);
  return {bright / (image.depth() == CV_8U ? full_8 : full_16), (bright - dark) / noise_of(image)};
}

}  // namespace vlp
