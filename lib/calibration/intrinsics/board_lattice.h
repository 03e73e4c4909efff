// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <vector>

#include "calibration/intrinsics/board_problem.h"
#include "detection/boards/board_detector.h"
#include "rig/board.h"

namespace vlp {

/// A board's corners as uniform lattices, which is what mrcal solves for. Those of a board of
/// squares are one; when the gap is as wide as a tag all corners of the tags form one, too;
/// otherwise corner k of every tag is a lattice of its own, with a pose of its own, a part.
class BoardLattice {
 public:
  /// Throws std::invalid_argument for a board whose parts would be lines: one row or column of tags
  /// with gaps of another width.
  explicit BoardLattice(const Board& board);

  /// Parts of a board: 1 or 4. Points along its width and height, and their distance.
  std::size_t parts() const { return parts_; }
  int cols() const { return cols_; }
  int rows() const { return rows_; }
  double spacing_m() const { return spacing_m_; }
  std::size_t points() const {
    return static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_);
  }
  /// Deflection of a whole board over that of a part, along x and y: a part is smaller.
  const Eigen::Vector2d& warp_of_board() const { return warp_of_board_; }

  struct Corner {
    /// z = 0 for a flat board.
    Eigen::Vector3d in_board_m;
    Eigen::Vector2d pixel;
    std::size_t part, point;
    /// Where the corner goes, per px, when the edges of its tag go inwards; 0 where squares that
    /// touch make the corner, which stays.
    Eigen::Vector2d inward{0, 0};
    /// What its residual is multiplied by.
    double weight = 1;
    /// Of its tag's edge to the tag's next corner.
    EdgeBow bow = {};
    /// SeenTag::Deviations; 0 where nobody knows.
    double sd_px = 0;
  };
  /// Every corner of what was seen, of a flat board: its points, or four of each tag, in its order.
  std::vector<Corner> corners(const SeenBoard& seen) const;
  /// SeenPoint::index of a point: part by part, row by row.
  std::size_t index_of(std::size_t part, std::size_t point) const {
    return part * points() + point;
  }
  /// Of which tag a point is, whose corners share its edges and so their errors; of a board of
  /// squares each by itself.
  std::size_t tag_of(std::size_t point) const {
    if (squares_ || parts_ > 1) return point;
    const auto cols = static_cast<std::size_t>(cols_);
    return point / cols / 2 * (cols / 2) + point % cols / 2;
  }
  /// The corners of a board of which a part is bent by so much.
  std::vector<Corner> bent(std::vector<Corner> corners,
                           const Eigen::Vector2d& warp_of_part_m) const;

  /// Computes the pose of a part from that of the board.
  BoardPose pose_of_part(const BoardPose& camera_from_board, std::size_t part) const;
  /// Corners that fix every part's pose: twelve of a board in one part (all, when it has no more),
  /// six of each of four parts; two or more in each of two rows.
  bool enough(const SeenBoard& seen) const;

 private:
  bool enough_points(const std::vector<SeenPoint>& seen) const;
  struct Place {
    int col, row;
    std::array<Eigen::Vector2d, 4> corners_m;
  };
  std::map<int, Place> places_;
  bool squares_, touching_;
  std::size_t parts_;
  int cols_, rows_;
  double spacing_m_;
  /// Where the parts begin in the board.
  std::array<Eigen::Vector2d, 4> origins_m_;
  Eigen::Vector2d warp_of_board_, field_m_;
};

}  // namespace vlp
