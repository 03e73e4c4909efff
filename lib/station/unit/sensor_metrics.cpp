// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/sensor_metrics.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "frontend/image_file.h"
#include "geometry/median.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr float kMinLitLevel = 0.2F;

/// Levels of a set of images as fractions of full scale.
struct ImageLevels {
  /// Levels that 1 % and 0.1 % of the pixels exceed, and the median, of each image.
  std::vector<double> percent, permille, median;
  /// Smallest excess of each pixel over the median of the 3 x 3 pixels about it, and its largest
  /// ratio to this median where that is lit, with the number of images in which it is lit.
  cv::Mat1f excess, ratio, lit_images;
};

/// Adds an image of levels from 0 to 1.
void add_image(const cv::Mat1f& image, ImageLevels& levels) {
  std::vector<float> sorted(image.begin(), image.end());
  const auto quantile = [&](double fraction) -> double {
    const auto at = sorted.begin() +
                    static_cast<std::ptrdiff_t>(fraction * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  };
  levels.percent.push_back(quantile(0.99));
  levels.permille.push_back(quantile(0.999));
  levels.median.push_back(quantile(0.5));
  cv::Mat1f around;
  constexpr int filter_size = 3;
  cv::medianBlur(image, around, filter_size);
  const cv::Mat1f excess = image - around;
  cv::Mat1f lit, ratio;
  cv::threshold(around, lit, kMinLitLevel, 1, cv::THRESH_BINARY);
  cv::divide(image.mul(lit), around, ratio);
  const bool is_first = levels.excess.empty();
  levels.excess = is_first ? excess : cv::Mat1f(cv::min(levels.excess, excess));
  levels.ratio = is_first ? ratio : cv::Mat1f(cv::max(levels.ratio, ratio));
  levels.lit_images = is_first ? lit : cv::Mat1f(levels.lit_images + lit);
}

/// Measures at most 12 images, at equal distances in the list, of the size of the first.
ImageLevels measure_levels(const std::vector<fs::path>& images) {
  constexpr std::size_t max_images = 12;
  const std::size_t count = std::min(max_images, images.size());
  ImageLevels levels;
  for (std::size_t i = 0; i < count; ++i) {
    try {
      const cv::Mat image = read_image(images[i * images.size() / count]);
      constexpr double full_8 = 255, full_16 = 65535;
      cv::Mat1f pixels;
      image.convertTo(pixels, CV_32F, 1 / (image.depth() == CV_8U ? full_8 : full_16));
      if (levels.excess.empty() || levels.excess.size() == pixels.size()) add_image(pixels, levels);
    } catch (const InputError&) {  // deleted since it was used
    }
  }
  return levels;
}

}  // namespace

std::vector<Metric> measure_board_levels(const std::vector<fs::path>& images) {
  const ImageLevels levels = measure_levels(images);
  if (levels.percent.empty()) return {};
  return {{"board_white", upper_median(levels.percent)}};
}

std::vector<Metric> measure_sensor(const std::vector<fs::path>& lamps,
                                   const std::vector<fs::path>& boards) {
  const ImageLevels dark = measure_levels(lamps), bright = measure_levels(boards);
  if (dark.permille.empty() || bright.percent.empty()) return {};
  constexpr double min_excess = 0.04, max_ratio = 0.75, min_lit_images = 3;
  const cv::Mat hot = dark.excess > min_excess;
  const cv::Mat cold = (bright.ratio < max_ratio) & (bright.lit_images >= min_lit_images);
  return {
      {"lamp_white", upper_median(dark.permille)},
      {"dark_level", upper_median(dark.median)},
      {"defective_pixels", static_cast<double>(cv::countNonZero(hot) + cv::countNonZero(cold))}};
}

}  // namespace vlp
