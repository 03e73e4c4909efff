// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_lamps.h"

#include <algorithm>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/corner_outliers.h"
#include "positioning/positioner.h"
#include "rig/board_layout.h"

namespace vlp {
namespace {

/// Returns the id of corner `corner` of a tag.
int corner_lamp_id(int tag, std::size_t corner) { return 4 * tag + static_cast<int>(corner); }

/// Returns the id of each point of a board of tags, by BoardLattice::board_point_index().
std::vector<int> list_point_ids(const BoardLattice& lattice, const std::vector<BoardTag>& tags) {
  std::vector<int> ids(lattice.num_board_parts() * lattice.points_per_part());
  BoardDetection all;
  for (const BoardTag& tag : tags) all.tags.push_back({tag.id, tag.corners_m});
  const auto corners = lattice.list_corners(all);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto index = lattice.board_point_index(corners[i].part, corners[i].point);
    ids[index] = corner_lamp_id(tags[i / 4].id, i % 4);
  }
  return ids;
}

/// Returns the smallest n for which a fix takes every n-th of the corners of a view.
std::size_t compute_step_to_limit(std::size_t corners) {
  return std::max<std::size_t>(1, (corners + Positioner::max_lamps - 1) / Positioner::max_lamps);
}

/// Adds all corners of the board to the map. Returns the ids of points (PointDetection::index).
std::vector<int> add_board_corners(const Board& board, const BoardLattice& lattice,
                                   const std::optional<double>& sd_m, LampMap& map) {
  const double height_m = compute_tag_field_size_m(board).y();
  const auto add_lamp = [&](int id, const Eigen::Vector2d& in_board_m) {
    map.lamps.push_back({id, {in_board_m.x(), height_m - in_board_m.y(), 0}, {}, {}, {}, sd_m});
  };
  if (board.has_squares()) {
    std::vector<int> ids;
    for (const Eigen::Vector2d& corner_m : list_inner_corners_m(board)) {
      ids.push_back(static_cast<int>(ids.size()));
      add_lamp(ids.back(), corner_m);
    }
    return ids;
  }
  const auto tags = list_board_tags(board);
  for (const BoardTag& tag : tags) {
    for (std::size_t k = 0; k < 4; ++k) add_lamp(corner_lamp_id(tag.id, k), tag.corners_m[k]);
  }
  return list_point_ids(lattice, tags);
}

}  // namespace

CornerLamps make_corner_lamps(std::span<const BoardView> views, const Board& board,
                              const std::optional<double>& sigma_px,
                              const std::optional<double>& sd_m) {
  const BoardLattice lattice(board);
  CornerLamps result;
  result.map.lamps_below_camera = true;
  const std::vector<int> point_ids = add_board_corners(board, lattice, sd_m, result.map);
  std::vector<std::vector<BoardLattice::Corner>> corners_of_views;
  for (const BoardView& view : views)
    corners_of_views.push_back(lattice.list_corners(view.detection));
  result.sigma_px = sigma_px ? sigma_px : estimate_corner_noise_px(corners_of_views);
  for (std::size_t i = 0; i < views.size(); ++i) {
    Frame frame{views[i].image, {}};
    const std::size_t step = compute_step_to_limit(corners_of_views[i].size());
    for (std::size_t k = 0; k < corners_of_views[i].size(); k += step) {
      const BoardLattice::Corner& corner = corners_of_views[i][k];
      const bool is_sd_known = corner.sd_px > 0;
      ++result.corners;
      result.corners_without_sd += is_sd_known ? 0 : 1;
      std::optional<double> sigma = is_sd_known ? std::optional(corner.sd_px) : result.sigma_px;
      if (sigma) sigma = std::clamp(*sigma / corner.weight, kMinSigma_px, kMaxSigma_px);
      const auto index = lattice.board_point_index(corner.part, corner.point);
      frame.detections.push_back({point_ids[index], corner.pixel, sigma});
    }
    if (frame.detections.empty()) continue;
    result.left_out += corners_of_views[i].size() - frame.detections.size();
    result.frames.push_back(std::move(frame));
  }
  return result;
}

}  // namespace vlp
