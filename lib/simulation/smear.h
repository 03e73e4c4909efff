// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "simulation/pixel_rays.h"

namespace vlp {

/// Where what is drawn is, as seen by the camera, at a time around that of the capture.
using CameraFromTarget = std::function<Eigen::Isometry3d(double time_s)>;

/// The longest way that one of the points (in the target's frame) goes in the image during an
/// exposure, in pixels, along a path of 16 pieces. Ways outside the image do not count.
double moved_px(const std::vector<Eigen::Vector3d>& points_m,
                const CameraFromTarget& camera_from_target, double exposure_s,
                const PixelRays& rays);

/// Into how many parts an exposure is split in which something moves by so much: 0.1 px or less
/// each, but 1000 parts at most.
int parts_of_exposure(double moved_px);

}  // namespace vlp
