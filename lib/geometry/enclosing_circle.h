// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "circle_fit.h"

namespace vlp {

/// Computes the smallest circle that contains all points, in the unit of the points. Its radius is
/// 0 for a single point.
/// @pre There is at least one point.
///
/// Adds the points one by one (Welzl 1991): the next point lies in the circle of the previous
/// points, or on the rim of the new circle.
Circle enclose_in_circle(std::span<const Eigen::Vector2d> points);

}  // namespace vlp
