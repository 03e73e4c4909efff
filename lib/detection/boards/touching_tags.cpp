// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/touching_tags.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "detection/boards/edge_crossing.h"
#include "detection/boards/saddle_point.h"
#include "detection/boards/tag_bits.h"
#include "geometry/homography.h"

namespace vlp {
namespace {

double shortest_edge_px(const SeenTag& tag) {
  double shortest = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) {
    shortest = std::min(shortest, (tag.corners_px[k] - tag.corners_px[(k + 1) % 4]).norm());
  }
  return shortest;
}

}  // namespace

TouchingTags::TouchingTags(const Board& board)
    : layout_(board_layout(board)),
      family_(tag_family(board.family)),
      border_bits_(board.border_bits),
      tag_size_m_(board.tag_size_m) {
  const double width = family_->width_at_border + 2 * (border_bits_ - 1);
  free_share_ = std::min(board.tag_spacing, border_bits_ / width);
}

std::optional<SeenTag> TouchingTags::exact(SeenTag tag, const GreyLevels& image) const {
  constexpr int least_px = 2, most_px = 5;
  constexpr double least_fit_px = 2.5, most_fit_px = 8, fit_share = 0.75;
  const double free_px = shortest_edge_px(tag) * free_share_;
  const int radius_px = std::clamp(static_cast<int>(free_px / 2), least_px, most_px);
  const int reach_px = std::max(least_px, static_cast<int>(free_px * 0.8));
  for (auto& corner : tag.corners_px) {
    const auto found = saddle_point(image.smoothed, corner, reach_px, radius_px);
    if (!found) return {};
    corner = *found;
  }
  const double fit_px = std::clamp(free_px * fit_share, least_fit_px, most_fit_px);
  const auto saddles = tag.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto found = edge_crossing(
        image.sharp, saddles[k],
        {saddles[(k + 1) % 4] - saddles[k], saddles[(k + 3) % 4] - saddles[k]}, fit_px);
    if (found) tag.corners_px[k] = *found;
  }
  if (!shows_its_bits(tag, image.smoothed, *family_, border_bits_)) return {};
  return tag;
}

std::optional<SeenTag> TouchingTags::expected(const BoardTag& missing,
                                              const std::vector<SeenTag>& tags) const {
  constexpr std::size_t enough = 4;
  constexpr double reach = 2.2;  // in tags: neighbors, including diagonal ones
  std::vector<std::pair<double, const SeenTag*>> near;
  for (const SeenTag& tag : tags) {
    const auto at = std::find_if(layout_.begin(), layout_.end(),
                                 [&](const BoardTag& known) { return known.id == tag.id; });
    const double away_m = (at->corners_m[0] - missing.corners_m[0]).norm();
    if (away_m < reach * tag_size_m_) near.emplace_back(away_m, &tag);
  }
  if (near.empty()) return {};
  std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second->id) < std::pair(b.first, b.second->id);
  });
  std::vector<PlanePair> pairs;
  for (std::size_t i = 0; i < std::min(enough, near.size()); ++i) {
    const auto at = std::find_if(layout_.begin(), layout_.end(), [&](const BoardTag& known) {
      return known.id == near[i].second->id;
    });
    for (std::size_t k = 0; k < 4; ++k) {
      pairs.push_back({at->corners_m[k], near[i].second->corners_px[k]});
    }
  }
  const Eigen::Matrix3d px_from_board = homography(pairs);
  SeenTag tag{missing.id, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    tag.corners_px[k] = (px_from_board * missing.corners_m[k].homogeneous()).hnormalized();
  }
  return tag;
}

std::vector<SeenTag> TouchingTags::others(const std::vector<SeenTag>& tags,
                                          const GreyLevels& image) const {
  std::vector<SeenTag> all = tags;
  for (bool more = true; more;) {
    more = false;
    for (const BoardTag& place : layout_) {
      const bool known = std::any_of(all.begin(), all.end(),
                                     [&](const SeenTag& tag) { return tag.id == place.id; });
      if (known) continue;
      const auto guess = expected(place, all);
      const auto tag = guess ? exact(*guess, image) : std::nullopt;
      if (!tag) continue;
      all.push_back(*tag);
      more = true;
    }
  }
  return {all.begin() + static_cast<std::ptrdiff_t>(tags.size()), all.end()};
}

}  // namespace vlp
