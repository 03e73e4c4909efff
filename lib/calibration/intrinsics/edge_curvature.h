// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// Moves the corners of a view's tags to the intersections of edges with the curvature of the lens,
/// instead of the measured curvature. The curvature of the lens is that of straight lines between
/// the corners. Afterwards the corners have this curvature.
///
/// The lens determines the curvature of an edge a hundred times more accurately than the edge
/// itself. A curvature fitted together with the ends makes the ends uncertain. With pixels all
/// along an edge the middle of a parabola has 9/4 of the variance of a straight line, and the
/// errors of both ends are correlated. A whole tag is then half as accurate.
///
/// The correction is a linear regression, with the measured curve b(w) and that of the lens l(w):
///   end += (straight line fitted to b - l over the pixels) at the end, outwards.
///
/// Corners without a measured curvature are kept: those of touching squares, and of files without
/// it. Tags are also kept if a corner would move by a quarter of an edge or more.
/// @return largest displacement of a corner, px
double apply_lens_edge_curvature(std::vector<BoardLattice::Corner>& corners, const Lens& lens);

}  // namespace vlp
