// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>
#include <vector>

namespace vlp {
namespace {

/// Returns the largest value of an image.
double get_full_scale_level(const cv::Mat& image) {
  constexpr double full_8 = 255, full_16 = 65535;
  return image.depth() == CV_8U ? full_8 : full_16;
}

/// Histogram of an image whose values are not negative.
class Histogram {
 public:
  explicit Histogram(const cv::Mat1f& image) : counts_(kBins + 1), pixels_(image.total()) {
    double max = 0;
    cv::minMaxLoc(image, nullptr, &max);
    if (!(max > 0)) return;
    bins_per_value_ = static_cast<float>(kBins / max);
    for (int row = 0; row < image.rows; ++row) {  // cv::Mat's iterator is slower
      for (const float value : std::span(image[row], static_cast<std::size_t>(image.cols)))
        ++counts_[static_cast<std::size_t>(value * bins_per_value_)];
    }
  }

  /// Returns the value that a fraction of the pixels does not exceed, to 1/2^14 of the largest.
  double quantile(double fraction) const {
    if (!(bins_per_value_ > 0)) return 0;
    const double before = fraction * static_cast<double>(pixels_ - 1);
    std::size_t bin = 0, pixels = counts_[0];
    while (static_cast<double>(pixels) <= before) pixels += counts_[++bin];
    constexpr double middle = 0.5;
    return (static_cast<double>(bin) + middle) / static_cast<double>(bins_per_value_);
  }

 private:
  static constexpr std::size_t kBins = 1 << 14;
  std::vector<std::size_t> counts_;
  std::size_t pixels_;
  float bins_per_value_ = 0;
};

/// Returns the standard deviation of a pixel's noise, in levels.
double estimate_noise(const cv::Mat& image) {
  // The squares of the kernel sum to 36: differences of independent pixels have six times the
  // standard deviation of a pixel.
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  constexpr double gain = 6;
  cv::Mat differences;
  cv::filter2D(image, differences, CV_32F, kernel);
  const double mean = cv::mean(cv::abs(differences))[0];
  const double rounding_sd = 1 / std::sqrt(12.0);
  return std::max(rounding_sd, std::sqrt(std::numbers::pi / 2) * mean / gain);
}

/// Returns the darkest and the brightest median of a pixel and its neighbors on both sides.
std::pair<double, double> compute_level_extremes(const cv::Mat& image, const cv::Point& side) {
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

ImageBlur measure_image_blur(const cv::Mat& image) {
  constexpr double smoothing_px = 1;  // against noise; its variance is subtracted below
  // The difference over two pixels averages the rise over them: a blur by a box 2 px wide.
  constexpr double difference_px2 = 4.0 / 12;
  cv::Mat1f smooth, along_x, along_y;
  image.convertTo(smooth, CV_32F, 1 / get_full_scale_level(image));
  cv::GaussianBlur(smooth, smooth, {}, smoothing_px);
  const Histogram levels(smooth);
  const double bright = levels.quantile(0.99), dark = levels.quantile(0.01);
  cv::Scharr(smooth, along_x, CV_32F, 1, 0, 1.0 / 32);
  cv::Scharr(smooth, along_y, CV_32F, 0, 1, 1.0 / 32);
  cv::magnitude(along_x, along_y, along_x);
  const double steepest = Histogram(along_x).quantile(0.999);
  constexpr double min_contrast = 0.02;
  if (bright - dark < min_contrast || steepest <= 0) {
    return {std::numeric_limits<double>::infinity(), bright};
  }
  const double sigma_px = (bright - dark) / (steepest * std::sqrt(2 * std::numbers::pi));
  const double variance_px2 = sigma_px * sigma_px - smoothing_px * smoothing_px - difference_px2;
  return {std::sqrt(std::max(0.0, variance_px2)), bright};
}

ImageSignal measure_image_signal(const cv::Mat& image) {
  const auto [dark_along, bright_along] = compute_level_extremes(image, {1, 0});
  const auto [dark_across, bright_across] = compute_level_extremes(image, {0, 1});
  const double dark = std::min(dark_along, dark_across);
  const double bright = std::max(bright_along, bright_across);
  return {dark / get_full_scale_level(image), (bright - dark) / estimate_noise(image)};
}

double compute_saturated_fraction(const cv::Mat& image, cv::Rect region) {
  region &= cv::Rect({}, image.size());
  if (region.empty()) return 0;
  constexpr double tolerance = 0.004;  // a level of 8 bits, by which JPEG changes white
  const cv::Mat white = image(region) >= (1 - tolerance) * get_full_scale_level(image);
  return cv::countNonZero(white) / static_cast<double>(region.area());
}

}  // namespace vlp
