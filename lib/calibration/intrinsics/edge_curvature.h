// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// Replaces the measured edge curvature by the lens's and shifts the corners accordingly, to the
/// intersections of the edges with the lens's curvature. The curvature of the lens is that of the
/// projections of straight lines between the corners.
///
/// The lens determines the curvature of an edge a hundred times more accurately than the edge
/// itself. A curvature fitted together with the ends makes the ends uncertain. With pixels all
/// along an edge the middle of a parabola has 9/4 of the variance of a straight line, and the
/// errors of both ends are correlated. A whole tag is then half as accurate.
///
/// The correction is a linear regression, with the measured curve b(w) and that of the lens l(w):
///   end += (straight line fitted to b - l over the pixels) at the end, outwards.
///
/// A whole tag is kept if an edge has no measured curvature (touching squares, files without it),
/// if the lens does not describe one of its edges, or if a corner would move by a quarter of an
/// edge or more.
/// @return largest displacement of a corner, px
double correct_corners_for_curved_edges(std::vector<BoardLattice::Corner>& corners,
                                        const Lens& lens);

}  // namespace vlp
