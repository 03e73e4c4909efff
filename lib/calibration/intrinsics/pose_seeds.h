// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// The poses of every view through one lens.
struct PoseSeeds {
  std::vector<BoardPose> poses;
  /// Infinite where there is no pose.
  std::vector<double> rms_px;
};
PoseSeeds poses_through(const IntrinsicsInput& input, const Lens& lens);

/// LENSMODEL_STEREOGRAPHIC with its centre in the middle of the image.
Lens stereographic(const IntrinsicsInput& input, double focal_px);

/// Focal lengths from a geometric series, best first: by the median of what their poses leave over.
std::vector<double> focal_lengths(const IntrinsicsInput& input);

}  // namespace vlp
