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

/// Fits the parameters of a splined lens to another lens, rotated into its frame. Least squares
/// over rays of all pieces of the grid that `lens` projects into the image or close to it.
///
/// The core is given; the control points compensate it. Control points without rays continue the
/// others with small second differences.
///
/// @param lens_from_splined  rotation from the frame of the splined lens to that of `lens`
/// @return std::nullopt if the rays do not determine a + b ux + c uy + d ux uy: the pieces are
///     about as large as the image, or outside it
/// @pre is_splined_lens_model(model); the core is fx, fy, cx, cy
std::optional<std::vector<double>> fit_splined_lens(
    const Lens& lens, const std::array<int, 2>& imager_px, LensModel model,
    const std::vector<double>& core,
    const Eigen::Matrix3d& lens_from_splined = Eigen::Matrix3d::Identity());

/// Returns one line for an error message when fit_splined_lens() fails. It states the
/// largest angles off the axis over the image, horizontally and vertically, in degrees. It also
/// names a splined model that can be fitted, if one is found.
/// @param imager_px  width and height of the image
/// @param model      splined model for which the fit failed
/// @param core       fx, fy, cx, cy, px
std::string explain_coarse_grid(const Lens& lens, const std::array<int, 2>& imager_px,
                                LensModel model, const std::vector<double>& core);

/// Returns a grid that extends to `u` off the axis along x and y, in the stereographic plane,
/// within the bounds of grids. Its order and number of control points along x are those of `grid`.
SplineGrid resize_spline_grid(const SplineGrid& grid, const Eigen::Vector2d& u);

/// Computes the core of a splined lens in the frame of a lens that minimizes the control points, by
/// least squares over the pixels. The core has the center of the lens, and the focal lengths of the
/// stereographic lens around it.
/// @pre the lens has rays at some of the pixels
std::vector<double> fit_spline_core(const Lens& lens, std::span<const Eigen::Vector2d> pixels);

}  // namespace vlp
