// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulation/coverage.h"
#include "simulation/scene.h"

namespace vlp {

/// Returns the radius up to which a glow emits light, its halo included, m.
double compute_source_radius_m(const Glow& glow);

/// Returns the radiance that an eye sees through a point inside the rim of a downlight, as a
/// fraction of the source's radiance (equation: see Recess). 0 for an eye at or above the plane of
/// the rim.
///
/// @param radius_m  radius of the rim, m
/// @param eye_m     position of the eye relative to the rim's center, m, z up
/// @param at_m      point of the rim's plane on the ray, relative to the rim's center, m
double compute_relative_radiance(const Recess& recess, double radius_m,
                                 const Eigen::Vector3d& eye_m, const Eigen::Vector2d& at_m);

/// Adds the radiance of a glow with a recess, chips, hot spots or a halo to each pixel of `image`,
/// which shows the window.
///
/// The fraction of a pixel inside the rim is exact (add_shape_to_image()). Radiances are evaluated
/// at the pixel's center, so they should vary little within a pixel.
void add_downlight(const PixelRays& rays, const PixelWindow& window,
                   const TargetFromCamera& glow_from_camera, const Glow& glow, cv::Mat1f& image);

}  // namespace vlp
