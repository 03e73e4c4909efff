// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

namespace vlp {

/// An image, and smoothed, as saddle_point() takes it.
struct GreyLevels {
  cv::Mat1b sharp;
  cv::Mat1f smoothed;
};

/// Where two black squares touch at a corner: the saddle point of the grey levels. The pixel with
/// the most negative determinant of the Hessian within reach_px of guess_px, then the saddle of
///   a x^2 + b x y + c y^2 + d x + e y + f
/// fitted to the pixels within radius_px of the nearest pixel, which follows the point found until
/// it stays. Nothing when it does not stay within 2 px of that pixel, when the fit is no saddle, or
/// at the image's edge. smoothed: grey levels, smoothed by about a pixel, without which the noise
/// of single pixels and the squares' sharp edges would count too much.
std::optional<Eigen::Vector2d> saddle_point(const cv::Mat1f& smoothed,
                                            const Eigen::Vector2d& guess_px, int reach_px,
                                            int radius_px);

}  // namespace vlp
