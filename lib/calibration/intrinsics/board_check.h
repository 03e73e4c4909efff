// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "camera/lens.h"
#include "detection/boards/board_view.h"

namespace vlp {

/// What the images say of a board against what board.yaml says. The square of one tag gives a
/// homography that tells where its neighbours are, in tags; so id order and spacing can be seen
/// without knowing the lens. (The size of a tag cannot: a larger board farther away looks the
/// same.)
struct BoardCheck {
  /// What is wrong with board.yaml, and what would be right, in one line; empty when nothing is.
  std::string problem;
  /// From a tag to the next one, in tags; nothing when no two neighbours are seen.
  std::optional<double> pitch;
};

/// lens: straightens the image when it is known, for a finer check of the spacing: 1 % of the pitch
/// instead of 5 %. shift_px: by which the edges of the tags are known to have gone inwards
/// (edge_shift.h).
BoardCheck check_board(const Board& board, std::span<const BoardView> views,
                       const std::optional<Lens>& lens, double shift_px = 0);

}  // namespace vlp
