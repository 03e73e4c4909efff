// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/robust_circle.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>

#include "geometry/arc.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double kTolerance = 0.35;

std::optional<RobustCircle> fit_circle_to(const Points& points, double tolerance = kTolerance) {
  return fit_robust_circle(points, std::vector<double>(points.size(), 1), tolerance);
}

void expect_found(const Points& points, const Circle& truth, double within, int count) {
  const auto fit = fit_circle_to(points);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->circle.center, IsNear(truth.center, within));
  EXPECT_NEAR(fit->circle.radius, truth.radius, within);
  EXPECT_EQ(fit->count, count);
  EXPECT_EQ(std::count(fit->inliers.begin(), fit->inliers.end(), true), count);
}

Points with_line(Points points, std::size_t count, const Vector2d& begin, const Vector2d& end) {
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(begin + (end - begin) * double(i) / double(count));
  }
  return points;
}

TEST(FitRobustCircle, MatchesCircleOfExactPoints) {
  for (const Circle& truth : {Circle{{300, 200}, 40}, Circle{{-3, 2}, 6}}) {
    for (const std::size_t count : {5U, 6U, 20U, 300U}) {
      expect_found(arc(truth, 0.3, 0.3 + 2 * pi, count), truth, 1e-9, int(count));
    }
  }
}

TEST(FitRobustCircle, MatchesCircleOfArc) {
  const Circle truth{{300, 200}, 40};
  for (const double arc_deg : {270.0, 180.0, 90.0}) {
    for (const double begin : {0.0, 1.0, 4.0}) {
      expect_found(arc(truth, begin, begin + arc_deg * pi / 180, 60), truth, 1e-9, 60);
    }
  }
}

TEST(FitRobustCircle, RejectsLineWithFortyPercentOfPoints) {
  const Circle truth{{300, 200}, 40};
  // Next to the circle, and along the extension of a chord, away from a tangent.
  expect_found(with_line(arc(truth, 0, 2 * pi, 60), 40, {345, 100}, {345, 300}), truth, 1e-9, 60);
  expect_found(with_line(arc(truth, 0, 2 * pi, 60), 40, {345, 220}, {420, 260}), truth, 1e-9, 60);
  // A lamp behind a straight occluder: half a circle and the chord.
  expect_found(with_line(arc(truth, 0.1, pi - 0.1, 60), 40, {265, 201}, {335, 201}), truth, 1e-9,
               60);
}

TEST(FitRobustCircle, CovarianceMatchesScatter) {
  const Circle truth{{300, 200}, 40};
  for (const double arc_rad : {2 * pi, pi}) {
    Random random(5);
    constexpr int draws = 2000;
    double sum = 0;
    for (int i = 0; i < draws; ++i) {
      const auto fit = fit_circle_to(with_noise(arc(truth, 0, arc_rad, 80), 0.1, random));
      ASSERT_TRUE(fit);
      const Vector2d error = fit->circle.center - truth.center;
      sum += error.dot(fit->center_covariance.llt().solve(error));
    }
    // Chi-square with two degrees of freedom has the mean 2, known within 0.14 (3 sigma) for 2000
    // draws. The covariance is itself estimated from 80 points, which adds a few percent.
    EXPECT_NEAR(sum / draws, 2.06, 0.2) << arc_rad;
  }
}

TEST(FitRobustCircle, RmsMatchesScatter) {
  Random random(6);
  const auto fit = fit_circle_to(with_noise(arc({{300, 200}, 40}, 0, 2 * pi, 2000), 0.1, random));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->rms, 0.1, 0.005);
}

TEST(FitRobustCircle, UsesWeights) {
  // Two parts that differ slightly: the one with large weights determines the fit.
  const Circle heavy{{300, 200}, 40};
  Points points = arc(heavy, 0, 1.5 * pi, 90);
  std::vector<double> weights(90, 1);
  for (const Vector2d& point : arc({{300, 200}, 40.3}, 1.5 * pi, 2 * pi, 90)) {
    points.push_back(point), weights.push_back(1e-4);
  }
  const auto fit = fit_robust_circle(points, weights, kTolerance);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->circle.center, IsNear(heavy.center, 1e-3));
  EXPECT_GT((fit_circle_to(points).value().circle.center - heavy.center).norm(), 0.02);
}

TEST(FitRobustCircle, IsDeterministic) {
  Random random(3);
  const Points points =
      with_line(with_noise(arc({{300, 200}, 40}, 0, 4, 60), 0.1, random), 30, {0, 0}, {300, 200});
  const auto first_fit = fit_circle_to(points), second_fit = fit_circle_to(points);
  ASSERT_TRUE(first_fit && second_fit);
  EXPECT_EQ(first_fit->circle.center, second_fit->circle.center);
  EXPECT_EQ(first_fit->circle.radius, second_fit->circle.radius);
  EXPECT_EQ(first_fit->inliers, second_fit->inliers);
}

TEST(FitRobustCircle, ReturnsNulloptForLessThanFiveInliers) {
  for (const std::size_t count : {0U, 1U, 3U, 4U}) {
    EXPECT_FALSE(fit_circle_to(arc({{300, 200}, 40}, 0, 2 * pi, count))) << count;
  }
  EXPECT_FALSE(fit_circle_to(Points(20, Vector2d(3, 4))));
  EXPECT_FALSE(
      fit_circle_to({{0, 0}, {100, 3}, {52, 71}, {-20, 55}, {33, 150}, {150, 90}, {7, 99}}));
}

TEST(FitRobustCircle, ReturnsNulloptForCollinearPoints) {
  EXPECT_FALSE(fit_circle_to(with_line({}, 50, {0, 0}, {300, 200})));
  EXPECT_FALSE(fit_circle_to(with_line({}, 5, {3, 0}, {3, 10})));
}

}  // namespace
}  // namespace vlp
