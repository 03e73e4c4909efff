// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "simulation/pixel_rays.h"

namespace vlp {

/// Pose of a rendered target in the camera frame at a time relative to that of the capture.
using CameraFromTarget = std::function<Eigen::Isometry3d(double time_s)>;

/// Returns the longest path of one of the points in the image during an exposure, px, approximated
/// by 16 segments. Segments away from the image do not count.
///
/// @param points_m  points in the target's frame
double compute_motion_px(const std::vector<Eigen::Vector3d>& points_m,
                         const CameraFromTarget& camera_from_target, double exposure_s,
                         const PixelRays& rays);

/// Returns the number of parts into which an exposure is divided so that the image moves by at most
/// 0.1 px in each; at most 1000.
int count_exposure_parts(double compute_motion_px);

}  // namespace vlp
