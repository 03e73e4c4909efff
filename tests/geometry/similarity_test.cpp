// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/similarity.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "geometry/similarity_fit.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

Vector2d mapped(const Similarity& similarity, const Vector2d& z) {
  return similarity.offset + complex_product(similarity.factor, z);
}

Points mapped(const Similarity& similarity, const Points& from) {
  Points to;
  for (const auto& z : from) to.push_back(mapped(similarity, z));
  return to;
}

double sum_of_squares(const Similarity& similarity, const Points& from, const Points& to) {
  double sum = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    sum += (mapped(similarity, from[i]) - to[i]).squaredNorm();
  }
  return sum;
}

TEST(FitSimilarityTransform, ReturnsKnownQuarterTurn) {
  const auto found = fit({{0, 0}, {1, 0}}, {{5, 5}, {5, 7}});
  ASSERT_TRUE(found);
  EXPECT_THAT(found->factor, IsNear(Vector2d(0, 2), 1e-15));
  EXPECT_THAT(found->offset, IsNear(Vector2d(5, 5), 1e-15));
}

TEST(FitSimilarityTransform, MapsBothPointsExactlyForTwoPairs) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Points from = random_points(random, 2), to = random_points(random, 2);
    const auto found = fit(from, to);
    ASSERT_TRUE(found);
    // Rounding grows with the stretch, as two random points may be close together.
    const double rounding = 4e-15 * (1 + found->factor.norm());
    EXPECT_THAT(mapped(*found, from[0]), IsNear(to[0], rounding));
    EXPECT_THAT(mapped(*found, from[1]), IsNear(to[1], rounding));
  }
}

TEST(FitSimilarityTransform, RecoversTrueTransformFromExactPairs) {
  Random random(2);
  for (const std::size_t count : {2U, 3U, 4U, 10U, 1000U}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Points line = random_points(random, 2, 5);
      const Similarity truth{line[0], line[1]};
      const Points from = random_points(random, count);
      const auto found = fit(from, mapped(truth, from));
      ASSERT_TRUE(found);
      // The distance of two of two points amplifies their rounding.
      const double rounding = 1e-13 / (count == 2 ? (from[1] - from[0]).norm() : 0.1);
      EXPECT_THAT(found->factor, IsNear(truth.factor, rounding));
      EXPECT_THAT(found->offset, IsNear(truth.offset, rounding));
    }
  }
}

TEST(FitSimilarityTransform, MinimizesSquaredDistances) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Points from = random_points(random, 5), to = random_points(random, 5);
    const auto best = fit(from, to);
    ASSERT_TRUE(best);
    const double min_cost = sum_of_squares(*best, from, to);
    for (int parameter = 0; parameter < 4; ++parameter) {
      for (const double step : {-1e-4, 1e-4}) {
        Similarity other = *best;
        (parameter < 2 ? other.offset : other.factor)(parameter % 2) += step;
        EXPECT_GT(sum_of_squares(other, from, to), min_cost);
      }
    }
  }
}

TEST(FitSimilarityTransform, ExcludesReflections) {
  // The mirror image of a triangle cannot be fitted, the triangle itself is.
  const Points from{{0, 0}, {1, 0}, {0, 2}};
  const Points mirrored{{0, 0}, {-1, 0}, {0, 2}};
  const auto found = fit(from, mirrored);
  ASSERT_TRUE(found);
  EXPECT_GT(sum_of_squares(*found, from, mirrored), 1);
  // The map is a rotation and a stretch whatever the points: orientation is kept.
  EXPECT_GT(complex_product_matrix(found->factor).determinant(), 0);
}

TEST(FitSimilarityTransform, RecoversTrueTransformToUtmCoordinates) {
  Random random(4);
  const Similarity truth{{5e5, 5e6}, {-1.2, 0.7}};
  for (int trial = 0; trial < 100; ++trial) {
    const Points from = random_points(random, 4);
    const auto found = fit(from, mapped(truth, from));
    ASSERT_TRUE(found);
    // Coordinates of 5e6 are rounded to 1e-9.
    EXPECT_THAT(found->factor, IsNear(truth.factor, 1e-8));
    EXPECT_THAT(found->offset, IsNear(truth.offset, 1e-8));
  }
}

TEST(FitSimilarityTransform, MapsPointsAccuratelyBetweenMapsFarFromOrigin) {
  Random random(5);
  const Similarity truth{{-3e5, 4e5}, {0.6, 0.8}};
  Points from = random_points(random, 4, 10);
  for (auto& point : from) point += Vector2d(5e5, 5e6);
  const Points to = mapped(truth, from);
  const auto found = fit(from, to);
  ASSERT_TRUE(found);
  // The offset belongs to an origin 5000 km away; at the points themselves 1e-9 is rounding.
  EXPECT_THAT(found->factor, IsNear(truth.factor, 1e-8));
  EXPECT_LT(std::sqrt(sum_of_squares(*found, from, to)), 1e-7);
}

}  // namespace
}  // namespace vlp
