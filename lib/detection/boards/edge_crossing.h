// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace vlp {

/// Image and its smoothed copy, which find_saddle_point() uses.
struct GrayLevels {
  cv::Mat1b sharp;
  cv::Mat1f smoothed;
};

/// Finds the saddle point of the gray levels at a corner where two black squares touch.
///
/// @param smoothed   gray levels, smoothed by about 1 px against pixel noise and sharp edges
/// @param guess_px   approximate pixel (u, v) of the corner
/// @param reach_px   radius of the search for the initial pixel
/// @param radius_px  radius of the window of the fit
/// @return           pixel (u, v) of the saddle; std::nullopt if the fit is no saddle, its point
///     is more than 2 px from the initial pixel, or a window reaches beyond the image
///
/// The initial pixel has the most negative determinant of the Hessian. The saddle of
///   a x^2 + b x y + c y^2 + d x + e y + f
/// is fitted in a window around the nearest pixel. The window is moved to the fitted point until
/// its center does not change (five iterations at most).
std::optional<Eigen::Vector2d> find_saddle_point(const cv::Mat1f& smoothed,
                                                 const Eigen::Vector2d& guess_px, int reach_px,
                                                 int radius_px);

/// Corner of fit_edge_crossing().
struct FittedCorner {
  Eigen::Vector2d pixel;
  /// Standard deviation, px, averaged over all directions: from the residuals of the fit, and the
  /// growth of the white squares, which is not the same along all edges.
  double sd_px;
  /// Blur of the edges: sigma of a Gaussian, px.
  double blur_px = 0;
};

/// Fits the intersection of the two edges at a corner where two black squares touch, by nonlinear
/// least squares of the gray levels.
///
/// @param guess_px   approximate pixel (u, v) of the corner
/// @param along      approximate directions of the edges in the image, of any length
/// @param radius_px  radius of the pixels around guess_px; they should show only the two squares
/// @return           the corner; std::nullopt for fewer than 16 pixels, if the pixels do not match
///     the model, or if the corner is too far from the guess: by over 1.5 px, or 0.4 (radius - 4
///     px) if that is larger
///
///   gray = (middle + contrast pattern) (1 + light . (x - corner))
///   pattern = 2 (c(d1 - g) c(d2 - g) + c(-d1 - g) c(-d2 - g)) - 1
///   d1, d2  distances from two parabolas through the corner, because the lens bends the edges
///   c       blurred step from 0 to 1, with the same blur for both edges
///   g       growth of the white squares, px, by overexposure and a tone curve
///   light   gradient of the illumination (vignetting), which would bias a fit without it
/// On rendered boards the corner is accurate to 0.01 px, a sixth of the error of
/// find_saddle_point().
std::optional<FittedCorner> fit_edge_crossing(const cv::Mat1b& image,
                                              const Eigen::Vector2d& guess_px,
                                              const std::array<Eigen::Vector2d, 2>& along,
                                              double radius_px);

}  // namespace vlp
