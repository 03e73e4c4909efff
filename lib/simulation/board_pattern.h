// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rig/board.h"

namespace vlp {

/// Rectangle on a board, in the board frame (list_board_tags.h).
struct PrintedRectangle {
  double left_m, top_m, right_m, bottom_m;
  bool white;
};

/// Returns the rectangles printed on white paper, in printing order: later rectangles cover earlier
/// ones.
/// @throws std::invalid_argument if the family lacks an id, or if the gaps are too small for the
/// family
std::vector<PrintedRectangle> make_board_pattern(const Board& board);

/// Returns the distance from the edge of the tag field (tag_field_m()) to the outermost printed
/// edge, m. Corner squares and the outer squares of chessboards extend beyond the field; otherwise
/// 0.
double printed_border_m(const Board& board);

}  // namespace vlp
