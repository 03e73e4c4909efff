// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace vlp {

/// Where the edges cross at a corner in which two black squares touch, by least squares over the
/// pixels within radius_px of guess_px:
///   grey = (middle + contrast step(d1) step(d2)) (1 + light . (x - corner)),
/// with d1 and d2 the distances from two parabolas through the corner, since the lens bends the
/// edges, and steps blurred alike. The light that changes over the image (vignetting) would draw a
/// fit without it to one side. along: the directions of the edges, roughly; the pixels should show
/// nothing but the two squares. Nothing when the pixels look otherwise, or when the corner is more
/// than 1.5 px from the guess. On rendered boards it is good to 0.01 px, a sixth of what
/// saddle_point() leaves.
std::optional<Eigen::Vector2d> edge_crossing(const cv::Mat1b& image,
                                             const Eigen::Vector2d& guess_px,
                                             const std::array<Eigen::Vector2d, 2>& along,
                                             double radius_px);

}  // namespace vlp
