// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulation/coverage.h"
#include "simulation/scene.h"

namespace vlp {

/// How far from its centre a glow gives light, its halo included.
double reach_m(const Glow& glow);

/// Returns the share of the source's radiance on a ray from the eye that crosses the rim's plane at
/// a place inside the rim (both from the rim's centre, in metres); see Recess. 0 for an eye above
/// that plane.
double share_inside(const Recess& recess, double radius_m, const Eigen::Vector3d& eye_m,
                    const Eigen::Vector2d& at_m);

/// Adds to each pixel of the window, which is all of `image`, the radiance of a glow with a recess,
/// chips, hot spots or a halo. How much of a pixel is inside the rim is exact (add_shape); what
/// they give there is taken at the pixel's middle, so they should vary little within a pixel.
void add_downlight(const PixelRays& rays, const PixelWindow& window,
                   const TargetFromCamera& glow_from_camera, const Glow& glow, cv::Mat1f& image);

}  // namespace vlp
