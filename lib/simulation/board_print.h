// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "rig/board.h"
#include "simulation/scene.h"
#include "simulation/shapes.h"

namespace vlp {

/// Printed bits of one AprilTag, in the orientation in which libapriltag renders it.
struct TagPattern {
  /// Edge length of the tag's square with its black border, in bits. This square is
  /// Board::tag_size_m wide.
  int border_width;
  /// Number of bits outside that square on each side (families whose border is white inside).
  int outside;
  /// Bits row by row from the top left, pattern_width_bits() along an edge; true is white.
  std::vector<bool> white;

  int pattern_width_bits() const { return border_width + 2 * outside; }
  std::size_t flat_bit_index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(pattern_width_bits()) +
           static_cast<std::size_t>(column);
  }
};

/// Returns the pattern of a tag.
/// @throws std::invalid_argument if the family has no such id, or if border_bits is 2 for a family
/// without a plain black border
TagPattern make_tag_pattern(const std::string& family, int id, int border_bits);

/// Values of white and black areas.
struct InkRadiances {
  double white, black;
};

/// Returns the rectangles printed on white paper, in the board frame (board_layout.h) and in
/// printing order: later rectangles cover earlier ones.
/// @throws std::invalid_argument if the family lacks an id, or if the gaps are too small for the
/// family
std::vector<Rectangle> make_board_pattern(const Board& board, const InkRadiances& ink);

/// Returns the distance from the edge of the tag field (compute_tag_field_size_m()) to the
/// outermost printed edge, m. Corner squares and the outer squares of chessboards extend beyond the
/// field; otherwise 0.
double compute_printed_margin_m(const Board& board);

/// Deflection of a warped board along z of the board frame (SceneBoard::warp_m).
class BoardWarp {
 public:
  explicit BoardWarp(const SceneBoard& board);

  /// Deflection and its derivatives with respect to x and y.
  struct Depth {
    double depth_m;
    Eigen::Vector2d slope;
  };
  /// Returns the deflection at a point (x, y) of the board, m.
  Depth compute_deflection(const Eigen::Vector2d& at_m) const;
  /// Returns (x, y) of the intersection of a ray with the warped board, in the board frame;
  /// std::nullopt if it does not meet the board in its direction, or beside the paper.
  std::optional<Eigen::Vector2d> intersect_parabola(const Eigen::Vector3d& origin,
                                                    const Eigen::Vector3d& direction) const;
  bool is_board_flat() const { return warp_m_.isZero(0); }

 private:
  /// Offset from the middle, in half fields, beyond which the deflection is constant: beside the
  /// paper, where the parabola would bend back.
  static constexpr double kMaxOffset = 1.5;

  Eigen::Array2d inverse_half_field_per_m_;
  Eigen::Vector2d warp_m_;
};

/// Printed board, warped or flat, for add_shape_to_image(). Values are radiances minus that of
/// the surroundings.
class BoardPattern {
 public:
  /// Creates the pattern of a board.
  /// @throws std::invalid_argument if make_board_pattern() rejects the board
  explicit BoardPattern(const SceneBoard& board);

  /// Returns (x, y) of the intersection of a ray with the board, in the board frame; NaN if there
  /// is none.
  Eigen::Vector2d intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
    return mosaic_.integrate_edge(p, q);
  }
  std::optional<double> find_uniform_value(const std::array<Eigen::Vector2d, 4>& corners) const {
    return mosaic_.find_uniform_value(corners);
  }

 private:
  BoardWarp warp_;
  RectanglePattern mosaic_;
};

}  // namespace vlp
