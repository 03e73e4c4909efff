// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "circle_fit.h"

namespace vlp {

/// The smallest circle that holds all points, by taking them in one by one (Welzl 1991): the circle
/// of those so far holds the next, or has it on its rim. Radius zero for a single point. Any units.
/// Precondition: one point or more.
Circle enclosing_circle(std::span<const Eigen::Vector2d> points);

}  // namespace vlp
