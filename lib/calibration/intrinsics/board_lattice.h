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

/// Corners of a board as uniform lattices, the only boards that mrcal solves for.
///
/// A board of squares is one lattice. A board of tags is one lattice if its gaps are as wide as its
/// tags. Otherwise corner k of all tags forms a lattice with its own pose, called a part.
class BoardLattice {
 public:
  /// Creates the lattice of a board.
  /// @throws std::invalid_argument for a board of tags if tag_spacing is not 1 and the board has
  ///     one row or column
  explicit BoardLattice(const Board& board);

  /// Number of parts into which the board is divided: 1 or 4.
  std::size_t num_board_parts() const { return parts_; }
  /// Number of points along the width and the height of a part.
  int lattice_cols() const { return cols_; }
  int lattice_rows() const { return rows_; }
  /// Distance between adjacent points of a part, m.
  double point_spacing_m() const { return spacing_m_; }
  std::size_t points_per_part() const {
    return static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_);
  }
  /// Ratio of the warp of the whole board to that of a part, along x and y; a part is smaller.
  const Eigen::Vector2d& board_to_part_warp_ratio() const { return board_warp_ratio_; }

  /// Corner of the board and its measurement in a view.
  struct Corner {
    /// Position in the board frame, m; z = 0 for a flat board.
    Eigen::Vector3d in_board_m;
    Eigen::Vector2d pixel;
    std::size_t part, point;
    /// Displacement (u, v) of the corner, px, if all edges of its tag move inwards by 1 px. 0 for
    /// corners between touching squares, which do not move.
    Eigen::Vector2d d_pixel_d_edge_shift{0, 0};
    /// Factor by which a solve multiplies the residual of the corner.
    double weight = 1;
    /// Curvature of the tag's edge from this corner to the tag's next corner.
    EdgeCurvature curvature = {};
    /// Standard deviation from pixel noise (PointDetection::sd_px), px; 0 if unknown.
    double sd_px = 0;
  };
  /// Returns all corners of a detection on a flat board, in the order of `seen`: its points, or
  /// four corners of each tag.
  std::vector<Corner> list_corners(const BoardDetection& seen) const;
  /// Returns the PointDetection::index of a point: part by part, row by row.
  std::size_t board_point_index(std::size_t part, std::size_t point) const {
    return part * points_per_part() + point;
  }
  /// Returns the index of the tag of a point. The corners of a tag share its edges and therefore
  /// have correlated errors. On a board of squares each point is a group of its own.
  std::size_t get_tag_of_point(std::size_t point) const {
    if (has_squares_ || parts_ > 1) return point;
    const auto cols = static_cast<std::size_t>(cols_);
    return point / cols / 2 * (cols / 2) + point % cols / 2;
  }
  /// Returns the corners of a board whose parts have the warp `warp_of_part_m`, along x and y.
  std::vector<Corner> apply_warp(std::vector<Corner> corners,
                                 const Eigen::Vector2d& warp_of_part_m) const;

  /// Computes the pose of a part from that of the board.
  BoardPose compute_part_pose(const BoardPose& camera_from_board, std::size_t part) const;
  /// Returns true if the corners determine the pose of every part:
  /// - points: at least 12 of a board in one part, 6 in each of four parts, or all points of a
  ///   smaller board; at least two points in each of two rows
  /// - tags: at least 3 of a board in one part; at least 6 of a board in four parts, in at least
  ///   two columns and two rows
  bool can_determine_pose(const BoardDetection& seen) const;

 private:
  bool can_determine_pose(const std::vector<PointDetection>& seen) const;
  struct TagPosition {
    int col, row;
    std::array<Eigen::Vector2d, 4> corners_m;
  };
  std::map<int, TagPosition> tag_positions_;
  bool has_squares_, is_touching_;
  std::size_t parts_;
  int cols_, rows_;
  double spacing_m_;
  /// Origin of each part in the board frame, m.
  std::array<Eigen::Vector2d, 4> origins_m_;
  Eigen::Vector2d board_warp_ratio_, field_m_;
};

}  // namespace vlp
