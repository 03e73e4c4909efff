// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "camera/lens.h"

namespace vlp {

/// Polygon in an image: its vertices in order, px.
using ImageRegion = std::vector<Eigen::Vector2d>;

/// Computes the region of the image where a lens is calibrated. It is the convex hull of the
/// corners used, extended by a margin and clipped to the image and to the pixels with a ray.
///
/// @param corners_px  corners used by the solve, px
/// @param imager_px   width and height of the image
/// @param others      other lenses that may be the true one; pixels need a ray through each
/// @return            polygon, px, clockwise in the image; empty if all corners are on one line
///
/// The margin is 4 % of the image diagonal along each axis. It is 0 for splined lenses, which are
/// undetermined outside the corners. If the region covers at least 98.5 % of the image, it is the
/// whole image. Outside the region no corner contradicts a wrong lens model.
///
/// A lens has rays up to the fold of its model only (Lens::project_point()). Where the boundary has
/// no ray, it moves towards the mean of the corners, to 0.25 px inside the image of the rays. If
/// that mean has no ray, the nearest corner with one replaces it; without any the region is empty.
/// This assumes that each line from there leaves the image of the rays once.
ImageRegion make_valid_region(const std::vector<Eigen::Vector2d>& corners_px,
                              const std::array<int, 2>& imager_px, const Lens& lens,
                              std::span<const Lens> others = {});

/// Computes the area of a region as a fraction of the image. The image extends from the center of
/// its first pixel to that of its last.
double compute_area_fraction(const ImageRegion& region, const std::array<int, 2>& imager_px);

}  // namespace vlp
