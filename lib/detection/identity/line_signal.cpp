// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "detection/identity/stripes.h"

namespace vlp {
namespace {

/// The level of a line between two columns: of five parts the second brightest, because something
/// may hide some, and a speck may brighten one.
template <typename Level>
double level_of(const Level* pixels, int begin, int end) {
  constexpr int parts = 5;
  double most = 0, second = 0;
  int counted = 0;
  for (int part = 0; part < parts; ++part) {
    const int from = begin + (end - begin) * part / parts;
    const int to = begin + (end - begin) * (part + 1) / parts;
    if (from == to) continue;
    double sum = 0;
    for (int column = from; column < to; ++column) sum += pixels[column];
    const double mean = sum / (to - from);
    second = std::max(second, std::min(most, mean));
    most = std::max(most, mean);
    ++counted;
  }
  return counted > 1 ? second : most;
}

template <typename Level>
std::vector<double> signal_of(const cv::Mat& image, const std::vector<Run>& chords, double dark) {
  std::vector<double> signal;
  signal.reserve(chords.size());
  for (const auto& [row, begin, end] : chords) {
    signal.push_back(level_of(image.ptr<Level>(row), begin, end) - dark);
  }
  return signal;
}

}  // namespace

std::vector<Run> chords_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const cv::Size& size) {
  constexpr double used_width = 0.8;
  const Eigen::Vector2d center = (low + high) / 2, half = (high - low) / 2;
  const int first = std::max(0, static_cast<int>(std::ceil(center.y() - kUsedHeight * half.y())));
  const int last =
      std::min(size.height - 1, static_cast<int>(std::floor(center.y() + kUsedHeight * half.y())));
  std::vector<Run> chords;
  for (int row = first; row <= last; ++row) {
    const double off = (row - center.y()) / half.y();
    const double used = used_width * half.x() * std::sqrt(std::max(0.0, 1 - off * off));
    const int begin = std::max(0, static_cast<int>(std::lround(center.x() - used)));
    const int end = std::min(size.width, static_cast<int>(std::lround(center.x() + used)) + 1);
    if (begin < end) chords.push_back({row, begin, end});
  }
  return chords;
}

std::vector<double> line_signal(const cv::Mat& image, const std::vector<Run>& chords, double dark) {
  return image.depth() == CV_8U ? signal_of<std::uint8_t>(image, chords, dark)
                                : signal_of<std::uint16_t>(image, chords, dark);
}

}  // namespace vlp
