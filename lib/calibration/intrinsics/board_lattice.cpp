// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_lattice.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "rig/board_layout.h"

namespace vlp {
namespace {

Eigen::Vector3d rotate_into_camera(const BoardPose& pose, const Eigen::Vector2d& in_board_m) {
  const Eigen::AngleAxisd rotation(pose.rotation.norm(), pose.rotation.normalized());
  return rotation * Eigen::Vector3d(in_board_m.x(), in_board_m.y(), 0);
}

/// Returns the displacement of corner k if the two edges that meet there move inwards by 1 px.
Eigen::Vector2d compute_inward_shift(const TagDetection& tag, std::size_t k) {
  const auto& corners = tag.corners_px;
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  Eigen::Matrix2d normals;
  int row = 0;
  for (const std::size_t other : {(k + 3) % 4, (k + 1) % 4}) {
    const Eigen::Vector2d along = (corners[other] - corners[k]).normalized();
    Eigen::Vector2d across(-along.y(), along.x());
    if (across.dot(middle - corners[k]) < 0) across = -across;
    normals.row(row++) = across.transpose();
  }
  const Eigen::Vector2d inward = normals.inverse() * Eigen::Vector2d::Ones();
  return inward.allFinite() ? inward : Eigen::Vector2d::Zero();
}

}  // namespace

BoardLattice::BoardLattice(const Board& board)
    : has_squares_(board.has_squares()), is_touching_(board.corner_squares) {
  constexpr double numeric_tolerance = 1e-9;
  field_m_ = compute_tag_field_size_m(board);
  if (has_squares_) {
    parts_ = 1;
    cols_ = board.cols - 1;
    rows_ = board.rows - 1;
    spacing_m_ = board.square_size_m;
    origins_m_.fill(Eigen::Vector2d::Zero());
    board_warp_ratio_.setOnes();
    return;
  }
  const bool uniform = std::abs(board.tag_spacing - 1) < numeric_tolerance;
  if (!uniform && (board.cols < 2 || board.rows < 2)) {
    throw std::invalid_argument("a board of one row of tags needs tag_spacing 1");
  }
  parts_ = uniform ? 1 : 4;
  cols_ = uniform ? 2 * board.cols : board.cols;
  rows_ = uniform ? 2 * board.rows : board.rows;
  spacing_m_ = uniform ? board.tag_size_m : compute_tag_pitch_m(board);
  const auto tags = list_board_tags(board);
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const int index = static_cast<int>(i);
    tag_positions_[tags[i].id] = {index % board.cols, index / board.cols, tags[i].corners_m};
  }
  origins_m_ = tags.front().corners_m;
  if (uniform) origins_m_.fill(Eigen::Vector2d::Zero());
  const Eigen::Array2d part_m = spacing_m_ * Eigen::Array2d(cols_ - 1, rows_ - 1);
  board_warp_ratio_ = (field_m_.array() / part_m).square();
}

std::vector<BoardLattice::Corner> BoardLattice::list_corners(const BoardDetection& seen) const {
  constexpr int right[] = {0, 1, 1, 0}, down[] = {1, 1, 0, 0};  // bottom left, bottom right, ...
  std::vector<Corner> all;
  if (has_squares_ || !seen.points.empty()) {
    all.reserve(seen.points.size());
    for (const auto& [index, pixel, sd_px, weight] : seen.points) {
      const std::size_t part = index / points_per_part(), point = index % points_per_part();
      const auto cols = static_cast<std::size_t>(cols_);
      const std::size_t row = point / cols;
      const Eigen::Vector2d node(static_cast<double>(point % cols), static_cast<double>(row));
      const Eigen::Vector2d in_board_m = origins_m_[part] + spacing_m_ * node;
      all.push_back(
          {{in_board_m.x(), in_board_m.y(), 0}, pixel, part, point, {0, 0}, weight, {}, sd_px});
    }
    return all;
  }
  all.reserve(4 * seen.tags.size());
  for (const TagDetection& tag : seen.tags) {
    const TagPosition& position = tag_positions_.at(tag.id);
    for (std::size_t k = 0; k < 4; ++k) {
      const int col = parts_ == 1 ? 2 * position.col + right[k] : position.col;
      const int row = parts_ == 1 ? 2 * position.row + down[k] : position.row;
      all.push_back({{position.corners_m[k].x(), position.corners_m[k].y(), 0},
                     tag.corners_px[k],
                     parts_ == 1 ? 0 : k,
                     static_cast<std::size_t>(row * cols_ + col),
                     is_touching_ ? Eigen::Vector2d::Zero() : compute_inward_shift(tag, k),
                     1,
                     tag.curvatures[k],
                     tag.corner_sds_px[k]});
    }
  }
  return all;
}

std::vector<BoardLattice::Corner> BoardLattice::apply_warp(
    std::vector<Corner> corners, const Eigen::Vector2d& warp_of_part_m) const {
  const Eigen::Vector2d warp_m = warp_of_part_m.cwiseProduct(board_warp_ratio_);
  for (Corner& corner : corners) {
    const Eigen::Array2d normalized_position =
        2 * corner.in_board_m.head<2>().array() / field_m_.array() - 1;
    corner.in_board_m.z() = warp_m.dot((1 - normalized_position.square()).matrix());
  }
  return corners;
}

BoardPose BoardLattice::compute_part_pose(const BoardPose& camera_from_board,
                                          std::size_t part) const {
  return {camera_from_board.rotation, camera_from_board.translation_m +
                                          rotate_into_camera(camera_from_board, origins_m_[part])};
}

bool BoardLattice::can_determine_pose(const std::vector<PointDetection>& seen) const {
  constexpr std::size_t min_count = 12, min_count_per_part = 6;  // of a part, where there are four
  std::vector<std::map<std::size_t, int>> in_row(parts_);
  std::vector<std::size_t> count(parts_);
  for (const PointDetection& point : seen) {
    const std::size_t part = point.index / points_per_part();
    ++count[part];
    ++in_row[part][point.index % points_per_part() / static_cast<std::size_t>(cols_)];
  }
  for (std::size_t part = 0; part < parts_; ++part) {
    const auto rows = std::count_if(in_row[part].begin(), in_row[part].end(),
                                    [](const auto& row) { return row.second > 1; });
    if (rows < 2) return false;
    // A small board may have no more.
    if (count[part] < std::min(points_per_part(), parts_ == 1 ? min_count : min_count_per_part))
      return false;
  }
  return true;
}

bool BoardLattice::can_determine_pose(const BoardDetection& seen) const {
  if (has_squares_ || !seen.points.empty()) return can_determine_pose(seen.points);
  constexpr std::size_t min_count = 3, min_count_per_part = 6;
  std::set<int> cols, rows;
  for (const TagDetection& tag : seen.tags) {
    cols.insert(tag_positions_.at(tag.id).col);
    rows.insert(tag_positions_.at(tag.id).row);
  }
  if (parts_ == 1) return seen.tags.size() >= min_count;
  return seen.tags.size() >= min_count_per_part && cols.size() > 1 && rows.size() > 1;
}

}  // namespace vlp
