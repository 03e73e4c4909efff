// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "camera/spline_grid.h"

namespace vlp {

/// The parameters of a splined lens that puts rays where `lens` puts them turned into its frame, by
/// least squares over the rays of all the grid's pieces that `lens` has in the image or near it.
/// The core is given, which control points make up for; those that no ray tells of go on straight.
/// Nothing when the rays are too few for that (a, b, c, d of a + b ux + c uy + d ux uy): the pieces
/// are about as large as the image, or beside it. Preconditions: is_splined(model), and the core is
/// fx, fy, cx, cy.
std::optional<std::vector<double>> splined_like(
    const Lens& lens, const std::array<int, 2>& imager_px, LensModel model,
    const std::vector<double>& core,
    const Eigen::Matrix3d& lens_from_splined = Eigen::Matrix3d::Identity());

/// One line, when splined_like() gives nothing: how far off its axis the lens sees, and a model
/// with which it gives something, when there is one.
std::string why_too_coarse(const Lens& lens, const std::array<int, 2>& imager_px, LensModel model,
                           const std::vector<double>& core);

/// A grid of the same order and control points along x that goes so far off the axis along x and y,
/// in the stereographic plane, its bounds permitting.
SplineGrid reaching(const SplineGrid& grid, const Eigen::Vector2d& u);

/// The core with which control points have least to make up for, by least squares over the pixels,
/// when a lens and a splined one share the camera's frame: the lens' centre, and the focal lengths
/// of the stereographic lens around it. Precondition: the lens has rays at some of the pixels.
std::vector<double> core_like(const Lens& lens, std::span<const Eigen::Vector2d> pixels);

}  // namespace vlp
