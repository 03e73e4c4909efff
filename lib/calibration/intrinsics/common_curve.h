// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "detection/boards/board_view.h"
#include "rig/board.h"

namespace vlp {

/// Puts corners where they are behind the tone curve that all images of a camera call for together,
/// by what the board's geometry and the levels beside the edges say of its gamma:
///   n log ratio(gamma) + (log gamma - log levels_gamma)^2 / (2 x 0.2^2),     n = 50 / least ratio,
/// is least, with ratio what a lens leaves of the corners behind that gamma (solve_intrinsics(), of
/// OPENCV8 or OPENCV_FISHEYE, whichever leaves less) over what the pixels' noise makes of them
/// (SeenTag::sds_px, in the median). Edges behind a wrong curve are off by shares of their blur
/// that differ from tag to tag with its width, so that no lens and no shift that changes evenly
/// over a view (edge_shifts()) make them fit. The levels (costs_of_levels()) tell gamma more
/// sharply, but falsely, as JPEG and sharpening leave beside an edge what looks like more of a
/// curve, or less: by 20 % rms. Nor do thousands of residuals tell it as sharply as they would if
/// the ratio were exact: n, instead of their number, lets 2 % of it weigh as much as the levels do,
/// and less where noise explains little of what is left. Of 24 views at most, evenly among those
/// that tell enough. By the levels alone where no lens is found, the board is not that of the
/// images, or half of those whose levels tell have no curve for sure. Returns gamma, 1 of none
/// (take_curve()). Throws as BoardLattice does.
double take_common_curve(std::vector<BoardView>& views, const Board& board);

}  // namespace vlp
