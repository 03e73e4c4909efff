// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "camera/lens_model.h"

namespace vlp {

/// Polygon in an image: its vertices in order, px.
using ImageRegion = std::vector<Eigen::Vector2d>;

/// Computes the region of the image where a lens is calibrated. It is the convex hull of the
/// corners used, extended by a margin and clipped to the image.
///
/// @param corners_px        corners used by the solve, px
/// @param imager_px         width and height of the image
/// @param other_model_fits  true if the corners do not distinguish the lens model from another one
/// @return                  convex polygon, px, clockwise in the image; empty if all corners are on
///     one line
///
/// The margin is 4 % of the image diagonal along each axis. It is 0 with `other_model_fits`, and
/// for splined lenses, which are undetermined outside the corners. If the region covers at least
/// 98.5 % of the image, it is the whole image. Outside the region no corner contradicts a wrong
/// lens model.
ImageRegion compute_valid_lens_region(const std::vector<Eigen::Vector2d>& corners_px,
                                      const std::array<int, 2>& imager_px, LensModel model,
                                      bool other_model_fits = false);

/// Computes the area of a region as a fraction of the image. The image extends from the center of
/// its first pixel to that of its last.
double compute_region_fraction_of_image_area(const ImageRegion& region,
                                             const std::array<int, 2>& imager_px);

}  // namespace vlp
