// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

namespace vlp {

/// Two views of a point of a plane.
struct PlanePair {
  Eigen::Vector2d from, to;
};

/// The homography that takes `from` to `to` with the least algebraic error: of all H of unit norm
/// the one that makes the sum of |(to, 1) x H (from, 1)|^2 smallest (direct linear transform, in
/// coordinates with mean 0 and spread 1). Four points or more, no three of four on a line;
/// otherwise it is not determined.
Eigen::Matrix3d homography(std::span<const PlanePair> pairs);

}  // namespace vlp
