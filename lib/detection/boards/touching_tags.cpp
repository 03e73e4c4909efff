// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/touching_tags.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "detection/boards/edge_crossing.h"
#include "detection/boards/tag_pattern.h"
#include "geometry/homography.h"

namespace vlp {
namespace {

double shortest_edge_px(const TagDetection& tag) {
  double shortest = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) {
    shortest = std::min(shortest, (tag.corners_px[k] - tag.corners_px[(k + 1) % 4]).norm());
  }
  return shortest;
}

}  // namespace

TouchingTags::TouchingTags(const Board& board)
    : layout_(list_board_tags(board)),
      family_(make_tag_family(board.family)),
      border_bits_(board.border_bits),
      tag_size_m_(board.tag_size_m) {
  const double width = width_in_bits(*family_, border_bits_);
  free_fraction_ = std::min(board.tag_spacing, border_bits_ / width);
}

std::optional<TagDetection> TouchingTags::exact(TagDetection tag, const GrayLevels& image) const {
  constexpr int min_px = 2, max_px = 5;
  constexpr double min_fit_px = 2.5, max_fit_px = 8, fit_fraction = 0.75;
  const double free_px = shortest_edge_px(tag) * free_fraction_;
  const int radius_px = std::clamp(static_cast<int>(free_px / 2), min_px, max_px);
  const int reach_px = std::max(min_px, static_cast<int>(free_px * 0.8));
  for (auto& corner : tag.corners_px) {
    const auto found = find_saddle_point(image.smoothed, corner, reach_px, radius_px);
    if (!found) return {};
    corner = *found;
  }
  const double fit_px = std::clamp(free_px * fit_fraction, min_fit_px, max_fit_px);
  const auto saddles = tag.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto found = fit_edge_crossing(
        image.sharp, saddles[k],
        {saddles[(k + 1) % 4] - saddles[k], saddles[(k + 3) % 4] - saddles[k]}, fit_px);
    if (found) tag.corners_px[k] = *found;
  }
  if (!matches_tag_bits(tag, image.smoothed, *family_, border_bits_)) return {};
  return tag;
}

std::optional<TagDetection> TouchingTags::predict(const BoardTag& missing,
                                                  const std::vector<TagDetection>& tags) const {
  constexpr double max_distance = 2.2;  // in tags: neighbors, including diagonal ones
  const auto [pairs, nearest_m] = find_nearest_corners(
      tags, layout_, max_distance * tag_size_m_,
      [&](const BoardTag& tag) { return (tag.corners_m[0] - missing.corners_m[0]).norm(); });
  if (pairs.empty()) return {};
  const Eigen::Matrix3d px_from_board = estimate_homography(pairs);
  TagDetection tag{missing.id, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    tag.corners_px[k] = (px_from_board * missing.corners_m[k].homogeneous()).hnormalized();
  }
  return tag;
}

std::vector<TagDetection> TouchingTags::find_missing(const std::vector<TagDetection>& tags,
                                                     const GrayLevels& image) const {
  std::vector<TagDetection> all = tags;
  for (bool more = true; more;) {
    more = false;
    for (const BoardTag& place : layout_) {
      const bool known = std::any_of(all.begin(), all.end(),
                                     [&](const TagDetection& tag) { return tag.id == place.id; });
      if (known) continue;
      const auto guess = predict(place, all);
      const auto tag = guess ? exact(*guess, image) : std::nullopt;
      if (!tag) continue;
      all.push_back(*tag);
      more = true;
    }
  }
  return {all.begin() + static_cast<std::ptrdiff_t>(tags.size()), all.end()};
}

}  // namespace vlp
