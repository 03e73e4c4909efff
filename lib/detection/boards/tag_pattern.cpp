// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_pattern.h"

#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

namespace vlp {

TagFamily make_tag_family(const std::string& name) {
  if (name == "tag36h11") return {tag36h11_create(), tag36h11_destroy};
  if (name == "tag25h9") return {tag25h9_create(), tag25h9_destroy};
  if (name == "tag16h5") return {tag16h5_create(), tag16h5_destroy};
  if (name == "tagCircle21h7") return {tagCircle21h7_create(), tagCircle21h7_destroy};
  if (name == "tagCircle49h12") return {tagCircle49h12_create(), tagCircle49h12_destroy};
  if (name == "tagCustom48h12") return {tagCustom48h12_create(), tagCustom48h12_destroy};
  if (name == "tagStandard41h12") return {tagStandard41h12_create(), tagStandard41h12_destroy};
  if (name == "tagStandard52h13") return {tagStandard52h13_create(), tagStandard52h13_destroy};
  throw std::invalid_argument("there is no tag family " + name);
}

int tag_width_bits(const apriltag_family_t& family, int border_bits) {
  return family.width_at_border + 2 * (border_bits - 1);
}

bool is_tag_bit_white(const apriltag_family_t& family, int id, uint32_t bit) {
  return ((family.codes[id] >> (family.nbits - 1 - bit)) & 1) != 0;
}

namespace {

/// Returns the level between four pixels by linear interpolation; std::nullopt for a point that is
/// in no pixel.
std::optional<float> interpolate_level(const cv::Mat1b& levels, const Eigen::Vector2d& pixel) {
  const Eigen::Array2d last(levels.cols - 1, levels.rows - 1);
  const Eigen::Array2d inside = pixel.array().max(0).min(last);
  if (!((pixel.array() - inside).abs() <= 0.5).all()) return std::nullopt;
  const int column = std::min(static_cast<int>(inside.x()), levels.cols - 2);
  const int row = std::min(static_cast<int>(inside.y()), levels.rows - 2);
  const auto x = static_cast<float>(inside.x() - column), y = static_cast<float>(inside.y() - row);
  const auto at = [&](int right, int down) {
    return static_cast<float>(levels(row + down, column + right));
  };
  return (1 - y) * ((1 - x) * at(0, 0) + x * at(1, 0)) + y * ((1 - x) * at(0, 1) + x * at(1, 1));
}

}  // namespace

bool has_tag_bits(const TagDetection& tag, const cv::Mat1b& levels, const apriltag_family_t& family,
                  int border_bits) {
  constexpr int max_wrong = 2;
  const double width = tag_width_bits(family, border_bits);
  const std::array<Eigen::Vector2d, 4> square{{{0, width}, {width, width}, {width, 0}, {0, 0}}};
  std::array<PlanePair, 4> pairs;
  for (std::size_t k = 0; k < 4; ++k) pairs[k] = {square[k], tag.corners_px[k]};
  const Eigen::Matrix3d px_from_bits = estimate_homography(pairs);
  std::vector<float> seen(family.nbits);
  for (uint32_t bit = 0; bit < family.nbits; ++bit) {
    const double middle = border_bits - 0.5;
    const Eigen::Vector2d at =
        (px_from_bits * Eigen::Vector3d(family.bit_x[bit] + middle, family.bit_y[bit] + middle, 1))
            .hnormalized();
    const auto level = interpolate_level(levels, at);
    if (!level) return false;
    seen[bit] = *level;
  }
  std::array<float, 2> sums{}, counts{};
  for (uint32_t bit = 0; bit < family.nbits; ++bit) {
    const std::size_t color = is_tag_bit_white(family, tag.id, bit) ? 1 : 0;
    sums[color] += seen[bit];
    counts[color] += 1;
  }
  const float threshold = (sums[0] / counts[0] + sums[1] / counts[1]) / 2;
  int wrong = 0;
  for (uint32_t bit = 0; bit < family.nbits; ++bit) {
    wrong += is_tag_bit_white(family, tag.id, bit) != (seen[bit] > threshold);
  }
  return wrong <= max_wrong;
}

TagGeometry::TagGeometry(const Board& board)
    : family_(make_tag_family(board.family)),
      width_(tag_width_bits(*family_, board.border_bits)),
      inside_(board.border_bits),
      outside_(family_->reversed_border ? 1 : board.tag_spacing * width_) {}

TagGeometry::Sides TagGeometry::list_white_segments(int id) const {
  Sides sides;
  if (family_->reversed_border) return sides;
  const int last = static_cast<int>(width_) - 1, border = static_cast<int>(inside_);
  for (uint32_t bit = 0; bit < family_->nbits; ++bit) {
    if (!is_tag_bit_white(*family_, id, bit)) continue;
    const int x = static_cast<int>(family_->bit_x[bit]) + border - 1;  // from the top left
    const int y = static_cast<int>(family_->bit_y[bit]) + border - 1;
    const std::array<int, 4> along{x, last - y, last - x, y}, deep{last - y, last - x, y, x};
    for (std::size_t k = 0; k < 4; ++k) {
      if (deep[k] == border) sides[k].push_back({double(along[k]), double(along[k] + 1)});
    }
  }
  return sides;
}

NearestCorners match_tag_corners(const std::vector<TagDetection>& tags,
                                 const std::vector<BoardTag>& layout, double max_distance_m,
                                 const std::function<double(const BoardTag&)>& distance_m) {
  constexpr std::size_t max_tags = 4;
  struct Neighbor {
    double distance_m;
    const TagDetection* tag;
    const BoardTag* place;
  };
  std::vector<Neighbor> neighbors;
  for (const TagDetection& tag : tags) {
    const BoardTag& place = *std::ranges::find(layout, tag.id, &BoardTag::id);
    if (distance_m(place) < max_distance_m) neighbors.push_back({distance_m(place), &tag, &place});
  }
  std::ranges::sort(neighbors, {}, [](const Neighbor& neighbor) {
    return std::pair(neighbor.distance_m, neighbor.tag->id);
  });
  NearestCorners nearest{{}, std::numeric_limits<double>::infinity()};
  if (!neighbors.empty()) nearest.distance_m = neighbors.front().distance_m;
  for (std::size_t i = 0; i < std::min(max_tags, neighbors.size()); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      nearest.pairs.push_back({neighbors[i].place->corners_m[k], neighbors[i].tag->corners_px[k]});
    }
  }
  return nearest;
}

}  // namespace vlp
