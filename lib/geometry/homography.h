// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

namespace vlp {

/// Corresponding points of two views of a plane.
struct PlanePair {
  Eigen::Vector2d from, to;
};

/// Estimates the homography H that maps points `from` to points `to`, by the direct linear
/// transform: (to, 1) ~ H (from, 1). H is defined up to scale and sign.
/// @pre There are at least four pairs, no three of four on a line; otherwise H is undetermined.
///
/// Minimizes the algebraic error, the sum of |(to, 1) x H (from, 1)|^2 over all H of unit norm. The
/// coordinates are normalized to mean 0 and RMS radius 1 first.
Eigen::Matrix3d estimate_homography(std::span<const PlanePair> pairs);

}  // namespace vlp
