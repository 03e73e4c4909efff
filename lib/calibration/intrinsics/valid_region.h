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

/// Returns the region of the image where a lens is calibrated: the convex hull of the corners used,
/// extended along each axis by 4 % of the image diagonal and clipped to the image.
///
/// Returns the whole image if the region covers at least 98.5 % of it, and an empty region without
/// three corners that are not on a line. The polygon is convex and clockwise in the image. Outside
/// it no corner contradicts a wrong lens model.
///
/// There is no margin for splined lenses, which are undetermined outside the corners, and if the
/// corners do not distinguish the model from another one (other_model_fits).
ImageRegion compute_valid_lens_region(const std::vector<Eigen::Vector2d>& corners_px,
                                      const std::array<int, 2>& imager_px, LensModel model,
                                      bool other_model_fits = false);

/// Computes the area of a region as a fraction of the image, which extends from the center of its
/// first pixel to that of its last.
double compute_fraction_of_image_area(const ImageRegion& region,
                                      const std::array<int, 2>& imager_px);

}  // namespace vlp
