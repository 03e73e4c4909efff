// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "board.h"

namespace vlp {

/// The board frame: origin at the top left corner of the top left tag's black border, or, of a
/// board of squares, where the top left square touches the one across; the board seen as printed
/// and upright; x right, y down, z into the paper, away from who looks at it.
struct BoardTag {
  int id;
  /// Corners of the black border in libapriltag's order: bottom left, bottom right, top right,
  /// top left.
  std::array<Eigen::Vector2d, 4> corners_m;
};

/// From one tag's (or square's) left (or top) edge to the next one's.
double tag_pitch_m(const Board& board);

/// From the first tag's left (top) edge to the last one's right (bottom) edge, or from the first
/// corner in which squares touch to the last.
Eigen::Vector2d tag_field_m(const Board& board);

/// The square of a board of squares is black; counted from the top left one.
bool is_black(const Board& board, int col, int row);

/// Every corner in which squares touch, row by row from the top left; of boards of squares.
std::vector<Eigen::Vector2d> square_corners_m(const Board& board);

/// Every tag or marker of the board, row by row from the top left; of a chessboard none.
std::vector<BoardTag> board_layout(const Board& board);

}  // namespace vlp
