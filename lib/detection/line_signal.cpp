// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "detection/stripes.h"

namespace vlp {
namespace {

template <typename Level>
std::vector<double> signal_of(const cv::Mat& image, const Eigen::Vector2d& low,
                              const Eigen::Vector2d& high, double dark) {
  constexpr double used_width = 0.6, most_width_px = 24;
  const Eigen::Vector2d center = (low + high) / 2, half = (high - low) / 2;
  const int first = std::max(0, static_cast<int>(std::ceil(center.y() - kUsedHeight * half.y())));
  const int last =
      std::min(image.rows - 1, static_cast<int>(std::floor(center.y() + kUsedHeight * half.y())));
  std::vector<double> signal;
  for (int row = first; row <= last; ++row) {
    const double off = (row - center.y()) / half.y();
    const double chord = half.x() * std::sqrt(std::max(0.0, 1 - off * off));
    const double used = std::min(used_width * chord, most_width_px / 2);
    const int begin = std::max(0, static_cast<int>(std::lround(center.x() - used)));
    const int end = std::min(image.cols, static_cast<int>(std::lround(center.x() + used)) + 1);
    if (begin >= end) continue;
    const auto* pixels = image.ptr<Level>(row);
    double sum = 0;
    for (int column = begin; column < end; ++column) sum += pixels[column];
    signal.push_back(sum / (end - begin) - dark);
  }
  return signal;
}

}  // namespace

std::vector<double> line_signal(const cv::Mat& image, const Eigen::Vector2d& low,
                                const Eigen::Vector2d& high, double dark) {
  return image.depth() == CV_8U ? signal_of<std::uint8_t>(image, low, high, dark)
                                : signal_of<std::uint16_t>(image, low, high, dark);
}

}  // namespace vlp
