// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "polygon.h"

#include <algorithm>
#include <cmath>

namespace vlp {

double compute_polygon_area(const std::vector<Eigen::Vector2d>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    twice += from.x() * to.y() - from.y() * to.x();
  }
  return std::abs(twice) / 2;
}

bool polygon_contains(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& point) {
  constexpr double tolerance = 1e-8;
  if (polygon.size() < 3) return false;
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &from = polygon[i], edge = polygon[(i + 1) % polygon.size()] - from;
    const Eigen::Vector2d offset = point - from;
    const double fraction = std::clamp(offset.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    if ((offset - fraction * edge).norm() <= tolerance) return true;
    const bool crosses_line = (offset.y() < 0) != (offset.y() < edge.y());
    const bool is_to_the_right = (offset.x() * edge.y() < offset.y() * edge.x()) == (edge.y() > 0);
    if (crosses_line && is_to_the_right) inside = !inside;
  }
  return inside;
}

}  // namespace vlp
