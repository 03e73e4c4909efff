// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rig/board.h"

namespace vlp {

/// A rectangle on a board, in the board frame (board_layout.h).
struct PrintedRectangle {
  double left_m, top_m, right_m, bottom_m;
  bool white;
};

/// What is printed on white paper, in the order of printing: the last on a spot is seen. Throws
/// std::invalid_argument when the family lacks an id, or when the gaps are too small for it.
std::vector<PrintedRectangle> board_pattern(const Board& board);

/// From tag_field_m() to the outermost of what is printed: corner squares, or the outer squares of
/// a board of squares.
double printed_border_m(const Board& board);

}  // namespace vlp
