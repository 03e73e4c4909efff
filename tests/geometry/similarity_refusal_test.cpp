// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/similarity_fit.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

TEST(FitSimilarityTransform, ReturnsNulloptForFewerThanTwoPairs) {
  EXPECT_FALSE(fit({}, {}));
  EXPECT_FALSE(fit({{1, 2}}, {{3, 4}}));
}

TEST(FitSimilarityTransform, ReturnsNulloptForCoincidentPoints) {
  // 0.1 is not a binary number: the mean of three differs from it in the last place.
  for (const double offset : {0.0, 0.1, 1.0 / 3, 5e6 + 0.1}) {
    for (const std::size_t count : {2U, 3U, 7U}) {
      const Points spot(count, Vector2d(offset, 0.1 - offset));
      Random random(6);
      const Points apart = random_points(random, count);
      EXPECT_FALSE(fit(spot, apart)) << offset << ", " << count;
      EXPECT_FALSE(fit(apart, spot)) << offset << ", " << count;
    }
  }
}

TEST(FitSimilarityTransform, ReturnsNulloptForDistancesWithinRounding) {
  EXPECT_FALSE(fit({{0.3, 0}, {0.1 + 0.2, 0}}, {{0, 0}, {1, 0}}));
  EXPECT_FALSE(fit({{0, 0}, {1, 0}}, {{5e6, 0}, {5e6 + 1e-9, 0}}));
}

TEST(FitSimilarityTransform, ReturnsNulloptForMirroredRegularPolygon) {
  // Its best factor is zero: no scale and no angle.
  for (const int corners : {3, 4, 5, 8}) {
    Points from, to;
    for (int i = 0; i < corners; ++i) {
      const double angle_rad = 2 * std::numbers::pi * i / corners;
      from.emplace_back(0.3 * std::cos(angle_rad) + 0.1, 0.3 * std::sin(angle_rad) - 0.2);
      to.emplace_back(2 + std::cos(angle_rad), 3 - std::sin(angle_rad));
    }
    EXPECT_FALSE(fit(from, to)) << corners;
  }
}

TEST(FitSimilarityTransform, ReturnsNulloptForNonFinitePoints) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fit({{0, 0}, {1, nan}}, {{0, 0}, {1, 1}}));
}

}  // namespace
}  // namespace vlp
