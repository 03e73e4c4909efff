// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// Moves the corners of a view's tags, each where its edges cross, to where they cross when the
/// edges bow as the lens bows straight lines between these corners, and not as their pixels alone
/// show it. An edge's bow is known from the lens a hundred times better than from the edge, and
/// fitted together with its ends it leaves these uncertain: of pixels all along an edge a
/// parabola's middle has nine quarters of a straight line's variance, and errors of its ends go
/// together, so that a tag as a whole is known half as well. By the linear regression of one on the
/// other: with the bow seen, b(w), and the lens' one, l(w),
///   end += (straight line fitted to b - l over the pixels) at the end, outwards.
/// Corners have the lens' bows then. Corners without bows stay: of touching squares, and from
/// files that do not tell them. Returns by how much one moved at most, in px.
double take_bows_of_lens(std::vector<BoardLattice::Corner>& corners, const Lens& lens);

}  // namespace vlp
