// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/enclosing_circle.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Points = std::vector<Eigen::Vector2d>;

TEST(EncloseInCircle, IsExactForOneOrTwoDistinctPoints) {
  EXPECT_EQ(enclose_in_circle(Points{{3, 4}}).radius, 0);
  const Circle pair = enclose_in_circle(Points{{0, 0}, {0, 2}});
  EXPECT_THAT(pair.center, IsNear(Eigen::Vector2d(0, 1), 1e-15));
  EXPECT_NEAR(pair.radius, 1, 1e-15);
  EXPECT_EQ(enclose_in_circle(Points(5, {3, 4})).radius, 0);
}

TEST(EncloseInCircle, HasOutermostPointsAsDiameterForCollinearPoints) {
  const Circle circle = enclose_in_circle(Points{{1, 1}, {0, 0}, {3, 3}, {2, 2}});
  EXPECT_THAT(circle.center, IsNear(Eigen::Vector2d(1.5, 1.5), 1e-12));
  EXPECT_NEAR(circle.radius, 1.5 * std::sqrt(2), 1e-12);
}

/// The circle contains all points, and no smaller circle does: its center is in the convex hull of
/// the points on its rim, so that these do not lie on one side of the center.
TEST(EncloseInCircle, ReturnsSmallestCircleContainingAllPoints) {
  Random random(1);
  for (int draw = 0; draw < 200; ++draw) {
    Points points;
    const std::size_t count = 3 + random.index(40);
    for (std::size_t i = 0; i < count; ++i) {
      points.emplace_back(1000 + random.normal(), 2 * random.normal());
    }
    const Circle circle = enclose_in_circle(points);
    Points rim;
    for (const auto& point : points) {
      const double distance = (point - circle.center).norm();
      ASSERT_LE(distance, circle.radius + 1e-9);
      if (distance > circle.radius - 1e-9) rim.push_back(point - circle.center);
    }
    for (double angle = 0; angle < 6.3; angle += 0.01) {
      double max_projection = -1;
      for (const auto& point : rim) {
        max_projection =
            std::max(max_projection, point.x() * std::cos(angle) + point.y() * std::sin(angle));
      }
      EXPECT_GE(max_projection, -1e-6 * circle.radius) << "it could move that way and shrink";
    }
  }
}

}  // namespace
}  // namespace vlp
