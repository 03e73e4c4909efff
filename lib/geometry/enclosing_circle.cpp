// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/enclosing_circle.h"

#include <cassert>
#include <cmath>

namespace vlp {
namespace {

using Points = std::span<const Eigen::Vector2d>;

bool contains(const Circle& circle, const Eigen::Vector2d& point) {
  constexpr double numeric_tolerance = 1e-12;
  return (point - circle.center).norm() <= circle.radius * (1 + numeric_tolerance);
}

Circle circle_of_diameter(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {(a + b) / 2, (a - b).norm() / 2};
}

/// Returns the circle through three points. For points on one line it is the circle whose diameter
/// connects the two points that are farthest apart.
Circle circle_through(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                      const Eigen::Vector2d& c) {
  const Eigen::Vector2d p = b - a, q = c - a;
  const double twice_area = 2 * (p.x() * q.y() - p.y() * q.x());
  const Eigen::Vector2d center(q.y() * p.squaredNorm() - p.y() * q.squaredNorm(),
                               p.x() * q.squaredNorm() - q.x() * p.squaredNorm());
  const Eigen::Vector2d offset = center / twice_area;
  if (offset.allFinite()) return {a + offset, offset.norm()};
  Circle widest = circle_of_diameter(a, b);
  for (const Circle& other : {circle_of_diameter(a, c), circle_of_diameter(b, c)}) {
    if (other.radius > widest.radius) widest = other;
  }
  return widest;
}

/// Returns the smallest circle that contains `points` and has both `a` and `b` on its rim.
Circle circle_through_two(Points points, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  Circle circle = circle_of_diameter(a, b);
  for (const auto& point : points) {
    if (!contains(circle, point)) circle = circle_through(a, b, point);
  }
  return circle;
}

Circle circle_through_one(Points points, const Eigen::Vector2d& a) {
  Circle circle{a, 0};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!contains(circle, points[i])) circle = circle_through_two(points.first(i), a, points[i]);
  }
  return circle;
}

}  // namespace

Circle enclose_in_circle(Points points) {
  assert(!points.empty());
  Circle circle{points.front(), 0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (!contains(circle, points[i])) circle = circle_through_one(points.first(i), points[i]);
  }
  return circle;
}

}  // namespace vlp
