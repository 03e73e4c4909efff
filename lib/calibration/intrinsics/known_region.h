// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "camera/lens_model.h"

namespace vlp {

/// A part of an image, a polygon, by its corners in turn.
using ImageRegion = std::vector<Eigen::Vector2d>;

/// Where a lens is known: the convex hull of the corners that it rests on, and around it a margin
/// of 4 % of the image's diagonal, the image's edges permitting; the whole image when that leaves
/// less than 1.5 % of it. Convex, clockwise as the image shows it. Beyond it no corner contradicts
/// a lens model that is wrong. A splined lens, which corners tell nothing of where they are not,
/// has no margin, nor has a lens whose model the corners do not tell from another (another_fits).
/// Empty without three corners that are not on a line.
ImageRegion known_region(const std::vector<Eigen::Vector2d>& corners_px,
                         const std::array<int, 2>& imager_px, LensModel model,
                         bool another_fits = false);

/// Computes the area of a region as a share of the image's, which reaches from the centre of its
/// first pixel to that of its last.
double share_of_image(const ImageRegion& region, const std::array<int, 2>& imager_px);

}  // namespace vlp
