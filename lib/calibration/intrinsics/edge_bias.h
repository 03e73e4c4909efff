// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/board_problem.h"
#include "camera/lens.h"

namespace vlp {

/// By how much the corners of tags are off where a detector takes them for the crossings of
/// straight lines fitted to the edges, as libapriltag does, while the lens bends the edges: the
/// crossings of lines fitted to points along the projected edges, less the projected corners. With
/// a wide lens it is 0.05 px, all outwards, which would pass for another lens. corners: four of
/// each tag in turn, as BoardLattice::corners() gives them. Zero where the lens does not see the
/// tag.
std::vector<Eigen::Vector2d> edge_bias_px(std::span<const BoardLattice::Corner> corners,
                                          const BoardPose& camera_from_board, const Lens& lens);

}  // namespace vlp
