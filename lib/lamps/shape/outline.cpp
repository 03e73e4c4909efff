// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline.h"

#include <algorithm>
#include <optional>

namespace vlp {
namespace {

/// Profile of a row from outside a light towards its inside: pixel i is in column `edge + direction
/// * i`.
struct Profile {
  const ImageView& image;
  int row, edge, direction;

  bool has(int i) const {
    const int column = edge + direction * i;
    return column >= 0 && column < image.width;
  }
  double operator()(int i) const { return image.gray_level_at_pixel(edge + direction * i, row); }

  /// Returns the first position from `begin` to before `end` where the profile rises through
  /// `level`; std::nullopt if there is none.
  std::optional<double> find_level_crossing(double level, int begin, int end) const {
    for (int i = begin; i < end && has(i) && has(i + 1); ++i) {
      const double below = (*this)(i), above = (*this)(i + 1);
      if (below < level && above >= level) return i + (level - below) / (above - below);
    }
    return std::nullopt;
  }
};

void add_edge(const Profile& profile, int width, double dark, std::vector<EdgePoint>& points) {
  constexpr int outside = -6, inside = 3, samples = 4;
  if (!profile.has(outside)) return;
  // Samples a few pixels of the light from 3 px inside on; further inside for soft edges, whose run
  // is wide.
  const auto level_at = [&](int first) {
    double sum = 0;
    for (int i = first; i < first + samples; ++i) sum += profile(i);
    return sum / samples - dark;
  };
  const int reach = width / 2;
  const auto rough = profile.find_level_crossing(dark + level_at(inside) / 2, outside, reach);
  if (!rough) return;
  const int first = std::min(static_cast<int>(*rough) + inside, width - samples);
  const double level = level_at(first);
  const auto at = profile.find_level_crossing(dark + level / 2, outside, reach);
  const auto low = profile.find_level_crossing(dark + level / 4, outside, reach);
  const auto high = profile.find_level_crossing(dark + 3 * level / 4, outside, reach);
  if (!at || level <= 0) return;
  const double rise_px = low && high ? *high - *low : reach;
  points.push_back({{profile.edge + profile.direction * *at, profile.row},
                    level,
                    rise_px,
                    profile.direction > 0});
}

}  // namespace

std::vector<EdgePoint> find_blob_outline(const ImageView& image, const Blob& blob,
                                         const Background& background) {
  constexpr int min_width = 8;
  std::vector<EdgePoint> points;
  points.reserve(2 * blob.runs.size());
  for (const PixelRun& run : blob.runs) {
    if (run.pixel_run_width_px() < min_width) continue;
    add_edge({image, run.row, run.begin, 1}, run.pixel_run_width_px(), background.level, points);
    add_edge({image, run.row, run.end - 1, -1}, run.pixel_run_width_px(), background.level, points);
  }
  // Between the stripes of a saturated lamp, spilled charge has no outline of its own.
  constexpr double min_fraction = 0.35;
  double brightest = 0;
  for (const EdgePoint& point : points) brightest = std::max(brightest, point.level);
  std::erase_if(points, [&](const EdgePoint& p) { return p.level < min_fraction * brightest; });
  return points;
}

}  // namespace vlp
