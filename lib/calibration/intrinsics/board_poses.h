// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/board_problem.h"
#include "calibration/intrinsics/intrinsics.h"
#include "camera/lens.h"

namespace vlp {

/// Pose of a board in one view through a known lens, and its RMS residual per axis.
struct ViewPose {
  BoardPose camera_from_board;
  double rms_px;
};

/// Estimates camera_from_board of one view by minimizing the reprojection residuals of its corners,
/// px, each times Corner::weight.
///
/// @return pose and RMS of the weighted residuals; std::nullopt if fewer than four corners have a
///     ray within 90 degrees of their mean ray, or if no pose projects all corners
///
/// A plane has two poses that look almost the same: tilted to one side or to the other. Both are
/// estimated in the undistorted image for a flat board (Collins and Bartoli, "Infinitesimal
/// plane-based pose estimation", 2014). Both are refined in pixels by the method of Levenberg and
/// Marquardt. The one with the smaller residual is returned.
std::optional<ViewPose> estimate_view_pose(std::span<const BoardLattice::Corner> corners,
                                           const Lens& lens);

/// Initial poses of the board in all views, estimated with one lens. `poses` are camera_from_board,
/// in the order of IntrinsicsInput::views.
struct InitialPoses {
  std::vector<BoardPose> poses;
  /// RMS reprojection residual of each view at its pose, per axis, px, in the order of
  /// IntrinsicsInput::views. Infinity for a view without a pose.
  std::vector<double> rms_px;
};
/// Estimates camera_from_board of each view with a lens (estimate_view_pose()).
InitialPoses estimate_board_poses(const IntrinsicsInput& input, const Lens& lens);

/// Returns a lens of model STEREOGRAPHIC with this focal length, px, and its principal point in the
/// middle of the image.
Lens make_initial_lens(const IntrinsicsInput& input, double focal_px);

/// Returns focal lengths of a geometric series, px, in ascending order of the median RMS residual
/// of the poses with them.
std::vector<double> rank_initial_focal_lengths(const IntrinsicsInput& input);

}  // namespace vlp
