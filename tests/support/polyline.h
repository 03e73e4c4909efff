// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <vector>

namespace vlp {

/// Distance of a point from the nearest point of a polyline.
inline double distance_from(const std::vector<Eigen::Vector2d>& polyline,
                            const Eigen::Vector2d& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < polyline.size(); ++i) {
    const Eigen::Vector2d begin = polyline[i - 1], along = polyline[i] - begin;
    const double share = std::clamp((point - begin).dot(along) / along.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (begin + share * along - point).norm());
  }
  return nearest;
}

}  // namespace vlp
