// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/circle_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/arc.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

void expect_found(const Circle& truth, const Points& points, double tolerance) {
  const auto fit = fit_circle(points);
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->converged);
  EXPECT_THAT(fit->circle.center, IsNear(truth.center, tolerance));
  EXPECT_NEAR(fit->circle.radius, truth.radius, tolerance);
  EXPECT_LE(fit->rms, tolerance);
}

TEST(FitCircle, RecoversCirclesOfAnySizeExactly) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const Circle truth{Vector2d(3, -2) * scale, 5 * scale};
    for (const std::size_t count : {3U, 4U, 12U, 1000U}) {
      expect_found(truth, arc(truth, 0, 2 * pi, count), 1e-14 * scale);
    }
  }
}

TEST(FitCircle, RecoversCircleFromExactShortArcs) {
  const Circle truth{{3, -2}, 5};
  for (const double arc_deg : {90.0, 30.0, 10.0, 3.0, 1.0}) {
    const double arc_rad = arc_deg * pi / 180;
    // A rounding error moves the center by the error over the sagitta, R arc^2 / 8, which
    // determines the radius.
    const double tolerance = 2e-14 / (arc_rad * arc_rad);
    expect_found(truth, arc(truth, 0.7, 0.7 + arc_rad, 12), tolerance);
  }
}

TEST(FitCircle, RecoversCircleFarFromOrigin) {
  // In UTM coordinates; they are rounded to 1e-9.
  for (const double radius : {0.1, 1.0, 100.0}) {
    const Circle truth{{5e5, 5e6}, radius};
    expect_found(truth, arc(truth, 0, 2 * pi, 12), 2e-9);
    expect_found(truth, arc(truth, 1, 2.5, 12), 2e-8);
  }
}

TEST(FitCircle, RecoversCircleFromShortArcsFarFromOrigin) {
  // 1e-9 of rounding over a sagitta of 2e-3 is a part in 2e6 of the radius.
  const Circle truth{{5e5, 5e6}, 1};
  expect_found(truth, arc(truth, 1, 1.12, 12), 1e-5);
}

TEST(FitCircle, MinimizesSquaredDistances) {
  const Points points{{1.4, 0}, {0, 1}, {-1, 0}, {0, -1}};
  const auto fit = fit_circle(points);
  ASSERT_TRUE(fit);
  const auto cost = [&](const Circle& circle) {
    double sum = 0;
    for (const auto& point : points) {
      sum += std::pow((point - circle.center).norm() - circle.radius, 2);
    }
    return sum;
  };
  const double min_cost = cost(fit->circle);
  EXPECT_NEAR(fit->rms, std::sqrt(min_cost / 4), 1e-15);
  for (const double step : {-1e-4, 1e-4}) {
    EXPECT_GT(cost({fit->circle.center + Vector2d(step, 0), fit->circle.radius}), min_cost);
    EXPECT_GT(cost({fit->circle.center + Vector2d(0, step), fit->circle.radius}), min_cost);
    EXPECT_GT(cost({fit->circle.center, fit->circle.radius + step}), min_cost);
  }
}

TEST(FitCircle, ReturnsCircleThroughThreePointsExactly) {
  const auto fit = fit_circle(Points{{0, 0}, {2, 0}, {0, 4}});
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->circle.center, IsNear(Vector2d(1, 2), 1e-14));
  EXPECT_NEAR(fit->circle.radius, std::sqrt(5), 1e-14);
  EXPECT_LE(fit->rms, 1e-14);
}

TEST(FitCircle, ReturnsInfiniteCovarianceForThreePoints) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    Points points = with_noise(Points(3, Vector2d(1, 2)), 1, random);
    const auto fit = fit_circle(points);
    ASSERT_TRUE(fit);
    EXPECT_TRUE((fit->center_covariance.array() == std::numeric_limits<double>::infinity()).all());
  }
}

TEST(FitCircle, ReturnsZeroCovarianceForExactPoints) {
  const auto fit = fit_circle(arc({{3, -2}, 5}, 0, 2, 8));
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->center_covariance, IsNear(Eigen::Matrix2d::Zero(), 1e-25));
}

TEST(FitCircle, ReturnsNulloptForFewerThanThreePoints) {
  EXPECT_FALSE(fit_circle({}));
  EXPECT_FALSE(fit_circle(Points{{1, 2}}));
  EXPECT_FALSE(fit_circle(Points{{1, 2}, {3, 4}}));
}

TEST(FitCircle, ReturnsNulloptForPointsOnOneLine) {
  Random random(1);
  // Far from the origin and close together the rounding of the points bends the line.
  const double places[][2] = {{0, 1}, {1, 1}, {300, 1}, {300, 1e-9}, {5e6, 1}, {5e6, 1e-3}};
  for (const auto& [far, length] : places) {
    for (int trial = 0; trial < 100; ++trial) {
      const double angle_rad = random.uniform(-pi, pi);
      const Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
      Points points;
      for (int i = 0; i < 3 + trial % 10; ++i) {
        points.push_back(Vector2d(far, -far / 3) + random.uniform(-length, length) * direction);
      }
      EXPECT_FALSE(fit_circle(points)) << far << ", " << length << ", trial " << trial;
    }
  }
}

TEST(FitCircle, ReturnsNulloptForCoincidentPoints) {
  // 0.1 is not a binary number: means of it differ from it in the last place.
  for (const double offset : {0.0, 0.1, 1.0 / 3, 5e6 + 0.1}) {
    for (const std::size_t count : {3U, 5U, 12U}) {
      EXPECT_FALSE(fit_circle(Points(count, Vector2d(offset, 0.1 - offset)))) << offset;
    }
  }
}

TEST(FitCircle, ReturnsNulloptForTwoDistinctPoints) {
  EXPECT_FALSE(fit_circle(Points{{1, 2}, {3, 4}, {1, 2}, {3, 4}}));
}

TEST(FitCircle, ReturnsNulloptForNonFinitePoints) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fit_circle(Points{{0, 0}, {2, 0}, {0, nan}, {1, 1}}));
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(fit_circle(Points{{0, 0}, {2, 0}, {0, infinite}, {1, 1}}));
}

}  // namespace
}  // namespace vlp
