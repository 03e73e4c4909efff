// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// Corrects the corners of tags in one view for the measured curvature of their edges. Replaces the
/// curvature by that of the lens, which projects straight edges, and moves each corner accordingly.
///
/// @param corners  four corners per tag, in the order of BoardLattice::Corner; pixel and bow are
///     changed
/// @return         largest displacement of a corner, px; 0 if none is corrected
///
/// The lens determines the curvature of an edge a hundred times more accurately than the edge
/// itself. A curvature fitted together with the ends makes the ends uncertain. With pixels all
/// along an edge the middle of a parabola has 9/4 of the variance of a straight line. The errors of
/// both ends are then correlated. The corners of a whole tag are then half as accurate.
///
/// The correction is a linear regression, with the measured curve b(w) and that of the lens l(w):
///   end += (straight line fitted to b - l over the pixels) at the end, outwards.
///
/// A tag is not changed if the curvature of an edge is unknown (touching squares, files without
/// it). It is not changed if the lens does not describe one of its edges. It is also not changed if
/// a corner would move by 25 % of an edge or more.
double correct_corners_for_curved_edges(std::vector<BoardLattice::Corner>& corners,
                                        const Lens& lens);

}  // namespace vlp
