// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "camera/lens.h"

namespace vlp {

/// Pixels all over an image, its edges among them, so many from left to right and about as far
/// apart from top to bottom.
std::vector<Eigen::Vector2d> pixel_grid(const std::array<int, 2>& imager_px, int cols = 41);

/// The rotation that takes the rays of `a` at the pixels to those of `b` with the least squares,
/// where both have one; nothing for fewer than three.
std::optional<Eigen::Matrix3d> b_from_a(const Lens& a, const Lens& b,
                                        std::span<const Eigen::Vector2d> pixels);

struct ProjectionDifference {
  double mean_px, worst_px;
  /// Standard deviation about 0, per axis and place: the root of the mean square over sqrt(2).
  double rms_px;
};

/// How far two lenses put a direction apart, over the image: every pixel of the grid is unprojected
/// by `a` and projected by `b`, turned by the rotation that fits the rays best, because what a lens
/// calls straight ahead is its own affair (mrcal, "Projection differences"). sigma_px: how well the
/// place is known, for the weights of that fit. Nothing when the lenses share no place.
std::optional<ProjectionDifference> projection_difference(
    const Lens& a, const Lens& b, const std::array<int, 2>& imager_px,
    const std::function<double(const Eigen::Vector2d&)>& sigma_px);

}  // namespace vlp
