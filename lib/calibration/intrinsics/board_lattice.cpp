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

Eigen::Vector3d turned(const BoardPose& pose, const Eigen::Vector2d& in_board_m) {
  const Eigen::AngleAxisd rotation(pose.rotation.norm(), pose.rotation.normalized());
  return rotation * Eigen::Vector3d(in_board_m.x(), in_board_m.y(), 0);
}

/// Returns the displacement of corner k if the two edges that meet there move inwards by 1 px.
Eigen::Vector2d inward_at(const SeenTag& tag, std::size_t k) {
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
    : squares_(board.has_squares()), touching_(board.corner_squares) {
  constexpr double rounding = 1e-9;
  field_m_ = tag_field_m(board);
  if (squares_) {
    parts_ = 1;
    cols_ = board.cols - 1;
    rows_ = board.rows - 1;
    spacing_m_ = board.square_size_m;
    origins_m_.fill(Eigen::Vector2d::Zero());
    warp_of_board_.setOnes();
    return;
  }
  const bool uniform = std::abs(board.tag_spacing - 1) < rounding;
  if (!uniform && (board.cols < 2 || board.rows < 2)) {
    throw std::invalid_argument("a board of one row of tags needs tag_spacing 1");
  }
  parts_ = uniform ? 1 : 4;
  cols_ = uniform ? 2 * board.cols : board.cols;
  rows_ = uniform ? 2 * board.rows : board.rows;
  spacing_m_ = uniform ? board.tag_size_m : tag_pitch_m(board);
  const auto tags = board_layout(board);
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const int index = static_cast<int>(i);
    places_[tags[i].id] = {index % board.cols, index / board.cols, tags[i].corners_m};
  }
  origins_m_ = tags.front().corners_m;
  if (uniform) origins_m_.fill(Eigen::Vector2d::Zero());
  const Eigen::Array2d part_m = spacing_m_ * Eigen::Array2d(cols_ - 1, rows_ - 1);
  warp_of_board_ = (field_m_.array() / part_m).square();
}

std::vector<BoardLattice::Corner> BoardLattice::corners(const SeenBoard& seen) const {
  constexpr int right[] = {0, 1, 1, 0}, down[] = {1, 1, 0, 0};  // bottom left, bottom right, ...
  std::vector<Corner> all;
  if (squares_ || !seen.points.empty()) {
    all.reserve(seen.points.size());
    for (const auto& [index, pixel, weight] : seen.points) {
      const std::size_t part = index / points(), point = index % points();
      const auto cols = static_cast<std::size_t>(cols_);
      const std::size_t row = point / cols;
      const Eigen::Vector2d node(static_cast<double>(point % cols), static_cast<double>(row));
      const Eigen::Vector2d in_board_m = origins_m_[part] + spacing_m_ * node;
      all.push_back({{in_board_m.x(), in_board_m.y(), 0}, pixel, part, point, {0, 0}, weight});
    }
    return all;
  }
  all.reserve(4 * seen.tags.size());
  for (const SeenTag& tag : seen.tags) {
    const Place& place = places_.at(tag.id);
    for (std::size_t k = 0; k < 4; ++k) {
      const int col = parts_ == 1 ? 2 * place.col + right[k] : place.col;
      const int row = parts_ == 1 ? 2 * place.row + down[k] : place.row;
      all.push_back({{place.corners_m[k].x(), place.corners_m[k].y(), 0},
                     tag.corners_px[k],
                     parts_ == 1 ? 0 : k,
                     static_cast<std::size_t>(row * cols_ + col),
                     touching_ ? Eigen::Vector2d::Zero() : inward_at(tag, k),
                     1,
                     tag.bows[k],
                     tag.sds_px[k]});
    }
  }
  return all;
}

std::vector<BoardLattice::Corner> BoardLattice::bent(std::vector<Corner> corners,
                                                     const Eigen::Vector2d& warp_of_part_m) const {
  const Eigen::Vector2d warp_m = warp_of_part_m.cwiseProduct(warp_of_board_);
  for (Corner& corner : corners) {
    const Eigen::Array2d share = 2 * corner.in_board_m.head<2>().array() / field_m_.array() - 1;
    corner.in_board_m.z() = warp_m.dot((1 - share.square()).matrix());
  }
  return corners;
}

BoardPose BoardLattice::pose_of_part(const BoardPose& camera_from_board, std::size_t part) const {
  return {camera_from_board.rotation,
          camera_from_board.translation_m + turned(camera_from_board, origins_m_[part])};
}

bool BoardLattice::enough_points(const std::vector<SeenPoint>& seen) const {
  constexpr std::size_t least = 12, least_of_parts = 6;  // of a part, where there are four
  std::vector<std::map<std::size_t, int>> in_row(parts_);
  std::vector<std::size_t> count(parts_);
  for (const SeenPoint& point : seen) {
    const std::size_t part = point.index / points();
    ++count[part];
    ++in_row[part][point.index % points() / static_cast<std::size_t>(cols_)];
  }
  for (std::size_t part = 0; part < parts_; ++part) {
    const auto rows = std::count_if(in_row[part].begin(), in_row[part].end(),
                                    [](const auto& row) { return row.second > 1; });
    if (rows < 2) return false;
    // A small board may have no more.
    if (count[part] < std::min(points(), parts_ == 1 ? least : least_of_parts)) return false;
  }
  return true;
}

bool BoardLattice::enough(const SeenBoard& seen) const {
  if (squares_ || !seen.points.empty()) return enough_points(seen.points);
  constexpr std::size_t least = 3, least_of_parts = 6;
  std::set<int> cols, rows;
  for (const SeenTag& tag : seen.tags) {
    cols.insert(places_.at(tag.id).col);
    rows.insert(places_.at(tag.id).row);
  }
  if (parts_ == 1) return seen.tags.size() >= least;
  return seen.tags.size() >= least_of_parts && cols.size() > 1 && rows.size() > 1;
}

}  // namespace vlp
