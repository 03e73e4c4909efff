// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>

#include "lamps/shape/shear.h"

namespace vlp {

/// Returns the normal equations of the distances of points from a circle; `sd` is the standard
/// deviation of a point, in radii.
inline OutlineEquations make_outline_equations(std::span<const Eigen::Vector2d> points,
                                               const Circle& circle,
                                               const Eigen::Vector2d& scanline_gradient,
                                               double sd) {
  OutlineEquations equations{circle, OutlineEquations::Matrix5::Zero(),
                             OutlineEquations::Vector5::Zero(), scanline_gradient};
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d away = (point - circle.center) / circle.radius;
    const double norm = away.norm(), c = away.x() / norm, s = away.y() / norm;
    const OutlineEquations::Vector5 slope{{c, s, 1, c * c - s * s, 2 * c * s}};
    equations.matrix += slope * slope.transpose() / (sd * sd);
    equations.gradient += (norm - 1) / (sd * sd) * slope;
  }
  return equations;
}

}  // namespace vlp
