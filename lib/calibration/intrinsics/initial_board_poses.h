// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Initial poses of the board in all views, estimated with one lens. `poses` are camera_from_board,
/// in the order of IntrinsicsInput::views.
struct InitialPoses {
  std::vector<BoardPose> poses;
  /// RMS reprojection residual of each view at its pose, per axis, px, in the order of
  /// IntrinsicsInput::views. Infinity for a view without a pose.
  std::vector<double> rms_px;
};
/// Estimates camera_from_board of each view with a lens (estimate_board_view_pose()).
InitialPoses estimate_initial_board_poses(const IntrinsicsInput& input, const Lens& lens);

/// Returns a lens of model STEREOGRAPHIC with this focal length, px, and its principal point in the
/// middle of the image.
Lens make_stereographic_lens(const IntrinsicsInput& input, double focal_px);

/// Returns focal lengths of a geometric series, px, in ascending order of the median RMS residual
/// of the poses with them.
std::vector<double> rank_initial_focal_lengths(const IntrinsicsInput& input);

}  // namespace vlp
