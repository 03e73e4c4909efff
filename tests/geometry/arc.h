// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "geometry/circle_fit.h"
#include "support/random.h"

namespace vlp {

using Points = std::vector<Eigen::Vector2d>;

/// Returns `count` evenly spaced points of `circle` between two angles, without the last one.
inline Points arc(const Circle& circle, double from_rad, double to_rad, std::size_t count) {
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double fraction = static_cast<double>(i) / static_cast<double>(count);
    const double angle_rad = from_rad + (to_rad - from_rad) * fraction;
    points.push_back(circle.center +
                     circle.radius * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
  }
  return points;
}

/// Adds normal noise to both coordinates of the points.
inline Points with_noise(Points points, double sigma, Random& random) {
  for (auto& point : points) {
    point.x() += sigma * random.normal();
    point.y() += sigma * random.normal();
  }
  return points;
}

}  // namespace vlp
