// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "board.h"

namespace vlp {

/// A tag in the board frame, with the board as printed and upright. Axes: x right, y down, z into
/// the paper, away from the viewer. Origin: top left corner of the top left tag's black border.
/// Boards of squares: the corner at which the top left square touches the diagonally adjacent one.
struct BoardTag {
  int id;
  /// Corners of the tag's black border in the board frame (x right, y down), m. They are in
  /// libapriltag's order: bottom left, bottom right, top right, top left.
  std::array<Eigen::Vector2d, 4> corners_m;
};

/// Returns the distance from the left (top) edge of a tag, or square, to that of the next one.
double compute_tag_pitch_m(const Board& board);

/// Returns the distance from the first tag's left (top) edge to the last tag's right (bottom) edge.
/// Boards of squares: from the first inner corner to the last.
Eigen::Vector2d compute_tag_field_size_m(const Board& board);

/// Returns true if the square is black. `col` and `row` count from the top left square.
bool is_square_black(const Board& board, int col, int row);

/// Returns the inner corners of a board of squares, row by row from the top left.
std::vector<Eigen::Vector2d> list_inner_corners_m(const Board& board);

/// Returns the tags or markers of a board, row by row from the top left; none for a chessboard.
std::vector<BoardTag> list_board_tags(const Board& board);

}  // namespace vlp
