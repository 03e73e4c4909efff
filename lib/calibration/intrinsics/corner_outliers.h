// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"

namespace vlp {

/// Returns the indices, ascending, of outliers among the corners of a view: corners more than max(3
/// px, a quarter of the distance to the nearest neighbor) from their predicted position.
///
/// Noise is smaller: such a corner belongs to something else or is a mistake in a file. Least
/// squares would distort the view or the lens to fit it.
///
/// Each corner is predicted by the homography of its nearest eight corners on the board, which
/// holds for any lens. The worst corner is removed and its neighbors are tested again. Returns no
/// corner if more than a tenth would be outliers: then the board or the order is another one.
std::vector<std::size_t> find_corner_outliers(const std::vector<BoardLattice::Corner>& corners);

}  // namespace vlp
