// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline.h"

#include <algorithm>
#include <optional>

namespace vlp {
namespace {

/// Returns the upper quartile of the levels of a run above the dark level, in gray levels.
double compute_level_inside(const ImageView& image, const PixelRun& run, double dark) {
  std::vector<int> levels;
  for (int column = run.begin; column < run.end; ++column)
    levels.push_back(image.gray_level_at_pixel(column, run.row));
  const auto quartile = levels.begin() + std::ssize(levels) * 3 / 4;
  std::nth_element(levels.begin(), quartile, levels.end());
  return *quartile - dark;
}

/// Returns the column of the first crossing of a level, from `begin` to before `end` in this
/// direction; std::nullopt if there is none or if `begin` is outside the image.
std::optional<double> find_level_crossing(const ImageView& image, int row, int begin, int end,
                                          double level) {
  if (begin < 0 || begin >= image.width) return std::nullopt;
  const int step = begin < end ? 1 : -1;
  for (int column = begin; column != end; column += step) {
    const double below = image.gray_level_at_pixel(column, row),
                 above = image.gray_level_at_pixel(column + step, row);
    if (below < level && above >= level) return column + step * (level - below) / (above - below);
  }
  return std::nullopt;
}

}  // namespace

std::vector<Eigen::Vector2d> trace_blob_outline(const ImageView& image, const Blob& blob,
                                                const Background& background) {
  constexpr int min_width_px = 8, margin_px = 6;
  constexpr double min_fraction = 0.35;
  std::vector<double> levels;
  for (const PixelRun& run : blob.runs)
    levels.push_back(run.pixel_run_width_px() < min_width_px
                         ? 0
                         : compute_level_inside(image, run, background.level));
  const double min_level =
      levels.empty() ? 0 : min_fraction * *std::max_element(levels.begin(), levels.end());
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < blob.runs.size(); ++i) {
    const auto& [row, begin, end] = blob.runs[i];
    if (!(levels[i] > 0 && levels[i] >= min_level)) continue;
    const int middle = (begin + end) / 2;
    const double half = background.level + levels[i] / 2;
    for (const int from : {begin - margin_px, end - 1 + margin_px}) {
      const auto column = find_level_crossing(image, row, from, middle, half);
      if (column) points.emplace_back(*column, row);
    }
  }
  return points;
}

}  // namespace vlp
