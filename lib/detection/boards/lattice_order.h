// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Counts the points of a board's one lattice of cols x rows points so that the board is seen from
/// its front, x right and y down on it: files may go up the columns. A lattice that looks the same
/// when the board is turned, a chessboard's, is also turned by a half, a square one by quarters,
/// until its rows go to the right in the image. That takes one end of the board for the other,
/// which changes neither lens nor warp, since the warp is the same from both ends; the warp of a
/// square board cannot be told.
void order_lattice(std::vector<SeenPoint>& points, int cols, int rows, bool looks_same_turned);

}  // namespace vlp
