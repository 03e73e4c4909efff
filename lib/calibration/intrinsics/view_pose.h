// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/board_problem.h"
#include "camera/lens.h"

namespace vlp {

/// A board's pose in one view through a known lens, and how well it fits, per axis.
struct ViewPose {
  BoardPose camera_from_board;
  double rms_px;
};

/// The pose with the least reprojection error. A plane seen through a lens has two poses that look
/// almost alike (it is tilted to one side or to the other); both are found in the undistorted image
/// (of the flat board; Collins and Bartoli, "Infinitesimal plane-based pose estimation", 2014),
/// refined in pixels by Levenberg and Marquardt's method, and compared. Nothing for fewer than four
/// corners, or when neither can be projected.
std::optional<ViewPose> view_pose(std::span<const BoardLattice::Corner> corners, const Lens& lens);

}  // namespace vlp
