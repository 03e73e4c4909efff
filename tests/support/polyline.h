// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace vlp {

/// Returns the nearest point of a polyline.
inline Eigen::Vector2d find_nearest_on_polyline(const std::vector<Eigen::Vector2d>& polyline,
                                                const Eigen::Vector2d& point) {
  Eigen::Vector2d nearest = polyline.front();
  for (std::size_t i = 1; i < polyline.size(); ++i) {
    const Eigen::Vector2d begin = polyline[i - 1], along = polyline[i] - begin;
    const double fraction = std::clamp((point - begin).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector2d on = begin + fraction * along;
    if ((on - point).squaredNorm() < (nearest - point).squaredNorm()) nearest = on;
  }
  return nearest;
}

/// Returns the distance of a point from a polyline.
inline double distance_from(const std::vector<Eigen::Vector2d>& polyline,
                            const Eigen::Vector2d& point) {
  return (find_nearest_on_polyline(polyline, point) - point).norm();
}

}  // namespace vlp
