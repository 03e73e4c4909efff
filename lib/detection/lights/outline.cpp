// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights/outline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "detection/lights/profile.h"

namespace vlp {
namespace {

template <typename Level>
void add_edge(const Profile<Level>& profile, int width, int row, double dark,
              std::vector<EdgePoint>& points) {
  constexpr int outside = -6, inside = 3, samples = 4;
  if (!profile.has(outside)) return;
  // Of the light: a few pixels from 3 px inside on; further in for soft edges, whose run is wide.
  const auto level_at = [&](int first) {
    double sum = 0;
    for (int i = first; i < first + samples; ++i) sum += profile(i);
    return sum / samples - dark;
  };
  const int reach = width / 2;
  const auto rough = profile.crossing(dark + level_at(inside) / 2, outside, reach);
  if (!rough) return;
  const int first = std::min(static_cast<int>(*rough) + inside, width - samples);
  const double level = level_at(first);
  const auto at = profile.crossing(dark + level / 2, outside, reach);
  const auto low = profile.crossing(dark + level / 4, outside, reach);
  const auto high = profile.crossing(dark + 3 * level / 4, outside, reach);
  if (!at || level <= 0) return;
  const double rise_px = low && high ? *high - *low : reach;
  points.push_back(
      {{profile.edge + profile.direction * *at, row}, level, rise_px, profile.direction > 0});
}

template <typename Level>
std::vector<EdgePoint> outline(const cv::Mat& image, const Blob& blob, double dark) {
  constexpr int least_width = 8;
  std::vector<EdgePoint> points;
  points.reserve(2 * blob.runs.size());
  for (const Run& run : blob.runs) {
    if (run.width() < least_width) continue;
    const auto* row = image.ptr<Level>(run.row);
    add_edge(Profile<Level>{row, image.cols, run.begin, 1}, run.width(), run.row, dark, points);
    add_edge(Profile<Level>{row, image.cols, run.end - 1, -1}, run.width(), run.row, dark, points);
  }
  // Between the stripes of a saturated lamp its charge spills over: no outline of its own.
  constexpr double least_share = 0.35;
  double brightest = 0;
  for (const EdgePoint& point : points) brightest = std::max(brightest, point.level);
  std::erase_if(points, [&](const EdgePoint& p) { return p.level < least_share * brightest; });
  return points;
}

template <typename Level>
std::vector<EdgePoint> refine(const cv::Mat& image, const std::vector<EdgePoint>& points,
                              const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                              double dark) {
  constexpr double flattest = 0.35, depth_px = 3, most_bent = 0.35;
  constexpr int before = 8, samples = 8;
  const Eigen::Vector2d center = (low + high) / 2, half = (high - low) / 2;
  std::vector<EdgePoint> result;
  result.reserve(points.size());
  for (const EdgePoint& point : points) {
    // The cosine of the angle between the row and the outline's normal.
    const Eigen::Vector2d normal =
        (point.pixel - center).cwiseQuotient(half.cwiseAbs2()).normalized();
    const double cosine = std::abs(normal.x());
    if (cosine < flattest) continue;
    const int direction = point.begins ? 1 : -1;
    const int origin = static_cast<int>(std::lround(point.pixel.x())) - direction * before;
    const Profile<Level> profile{image.ptr<Level>(static_cast<int>(point.pixel.y())), image.cols,
                                 origin, direction};
    const double up = (point.pixel.y() - center.y()) / half.y();
    const double chord_px = 2 * half.x() * std::sqrt(std::max(0.0, 1 - up * up));
    if (2 * depth_px / cosine + samples > chord_px) continue;
    const int first = before + static_cast<int>(std::lround(depth_px / cosine));
    if (!profile.has(0) || !profile.has(first + samples)) continue;
    // The light next to the edge, by a line through what is further in: lamps darken towards their
    // rim, and the lens towards the image's.
    double sum = 0, moment = 0;
    for (int i = 0; i < samples; ++i) {
      sum += profile(first + i);
      moment += (i - (samples - 1) / 2.0) * profile(first + i);
    }
    constexpr double square = samples * (samples * samples - 1) / 12.0;
    const double back = first + (samples - 1) / 2.0 - before;
    const double inner = sum / samples - dark, level = inner - moment / square * back;
    // What hides the light further in bends the line too much.
    if (std::abs(level - inner) > most_bent * inner) continue;
    const auto at = profile.crossing(dark + level / 2, 0, first);
    if (level <= 0 || !at) continue;
    EdgePoint better = point;
    better.pixel.x() = origin + direction * *at;
    better.level = level;
    result.push_back(better);
  }
  return result;
}

}  // namespace

std::vector<EdgePoint> refined(const cv::Mat& image, const std::vector<EdgePoint>& points,
                               const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                               const Background& background) {
  return image.depth() == CV_8U ? refine<std::uint8_t>(image, points, low, high, background.level)
                                : refine<std::uint16_t>(image, points, low, high, background.level);
}

std::vector<EdgePoint> outermost(std::vector<EdgePoint> points) {
  const auto further_out = [](const EdgePoint& a, const EdgePoint& b) {
    if (a.pixel.y() != b.pixel.y()) return a.pixel.y() < b.pixel.y();
    if (a.begins != b.begins) return a.begins;
    return a.begins ? a.pixel.x() < b.pixel.x() : a.pixel.x() > b.pixel.x();
  };
  const auto same_side = [](const EdgePoint& a, const EdgePoint& b) {
    return a.pixel.y() == b.pixel.y() && a.begins == b.begins;
  };
  std::sort(points.begin(), points.end(), further_out);
  points.erase(std::unique(points.begin(), points.end(), same_side), points.end());
  return points;
}

std::vector<EdgePoint> outline_of(const cv::Mat& image, const Blob& blob,
                                  const Background& background) {
  return image.depth() == CV_8U ? outline<std::uint8_t>(image, blob, background.level)
                                : outline<std::uint16_t>(image, blob, background.level);
}

}  // namespace vlp
