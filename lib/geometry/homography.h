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
/// Minimizes the algebraic error over all H of unit norm: the sum over the pairs of
///   (h_1 p - u h_3 p)^2 + (h_2 p - v h_3 p)^2,
/// with p = (from, 1), to = (u, v) and h_i, row i of H. The coordinates of `from` and of `to` are
/// first normalized to mean 0 and RMS radius 1, each.
Eigen::Matrix3d estimate_homography(std::span<const PlanePair> pairs);

}  // namespace vlp
