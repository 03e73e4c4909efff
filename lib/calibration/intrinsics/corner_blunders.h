// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"

namespace vlp {

/// Corners of a view that lie where their neighbours do not put them: by a quarter of the way to
/// the nearest of them, and by 3 px, or more. That is no noise, but a corner of something else, or
/// a slip in a file; least squares would bend the view, or the lens, to it. By index, rising.
///
/// Each corner is compared with where the homography of its nearest eight puts it, which holds for
/// any lens; the worst is taken out and the others are looked at again, at most so often that a
/// tenth of the corners is gone.
std::vector<std::size_t> corner_blunders(const std::vector<BoardLattice::Corner>& corners);

}  // namespace vlp
