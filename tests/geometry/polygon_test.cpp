// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace vlp {
namespace {

TEST(PolygonContains, MatchesInsideOfConcavePolygonInEitherDirection) {
  std::vector<Eigen::Vector2d> polygon{{0, 0}, {400, 0}, {200, 100}, {400, 400}, {0, 400}};
  for (int direction = 0; direction < 2; ++direction) {
    EXPECT_TRUE(polygon_contains(polygon, {199, 100}));
    EXPECT_TRUE(polygon_contains(polygon, {300, 300}));
    EXPECT_FALSE(polygon_contains(polygon, {201, 100}));
    EXPECT_FALSE(polygon_contains(polygon, {300, 100}));
    EXPECT_FALSE(polygon_contains(polygon, {-1, 100}));
    EXPECT_FALSE(polygon_contains(polygon, {-1, 400}));
    EXPECT_NEAR(compute_polygon_area(polygon), 120000, 1e-9);
    std::reverse(polygon.begin(), polygon.end());
  }
}

TEST(PolygonContains, IncludesCornersAndEdges) {
  const std::vector<Eigen::Vector2d> polygon{{0, 0}, {400, 0}, {200, 100}, {400, 400}, {0, 400}};
  EXPECT_TRUE(polygon_contains(polygon, {200, 100}));
  EXPECT_TRUE(polygon_contains(polygon, {300, 50}));
  EXPECT_TRUE(polygon_contains(polygon, {400, 400}));
  EXPECT_FALSE(polygon_contains(polygon, {400.001, 400}));
}

TEST(PolygonContains, ReturnsFalseForFewerThanThreeCorners) {
  EXPECT_FALSE(polygon_contains({}, {1, 1}));
  EXPECT_FALSE(polygon_contains({{0, 0}, {2, 2}}, {1, 1}));
  EXPECT_EQ(compute_polygon_area({}), 0);
}

}  // namespace
}  // namespace vlp
