// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/robust_ellipse.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "geometry/arc.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double kTolerance = 0.35;

std::optional<RobustEllipse> fit_circle_to(const Points& points, double tolerance = kTolerance) {
  return fit_robust_circle(points, std::vector<double>(points.size(), 1), tolerance);
}

void expect_found(const Points& points, const Circle& truth, double within, int count) {
  const auto fit = fit_circle_to(points);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->center, IsNear(truth.center, within));
  EXPECT_NEAR(fit->to_circle().radius, truth.radius, within);
  EXPECT_EQ(fit->count, count);
  EXPECT_EQ(std::count(fit->inliers.begin(), fit->inliers.end(), true), count);
}

Points with_line(Points points, std::size_t count, const Vector2d& begin, const Vector2d& end) {
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(begin + (end - begin) * double(i) / double(count));
  }
  return points;
}

TEST(FitRobustCircle, RecoversCircleFromExactPoints) {
  for (const Circle& truth : {Circle{{300, 200}, 40}, Circle{{-3, 2}, 6}}) {
    for (const std::size_t count : {5U, 6U, 20U, 300U}) {
      expect_found(arc(truth, 0.3, 0.3 + 2 * pi, count), truth, 1e-9, int(count));
    }
  }
}

TEST(FitRobustCircle, RecoversCircleFromArcOf90DegreesOrMore) {
  const Circle truth{{300, 200}, 40};
  for (const double arc_deg : {270.0, 180.0, 90.0}) {
    for (const double begin : {0.0, 1.0, 4.0}) {
      expect_found(arc(truth, begin, begin + arc_deg * pi / 180, 60), truth, 1e-9, 60);
    }
  }
}

TEST(FitRobustCircle, RecoversCircleDespiteLineWithFortyPercentOfPoints) {
  const Circle truth{{300, 200}, 40};
  // Next to the circle, and along the extension of a chord, away from a tangent.
  expect_found(with_line(arc(truth, 0, 2 * pi, 60), 40, {345, 100}, {345, 300}), truth, 1e-9, 60);
  expect_found(with_line(arc(truth, 0, 2 * pi, 60), 40, {345, 220}, {420, 260}), truth, 1e-9, 60);
  // A lamp behind a straight occluder: half a circle and the chord.
  expect_found(with_line(arc(truth, 0.1, pi - 0.1, 60), 40, {265, 201}, {335, 201}), truth, 1e-9,
               60);
}

TEST(FitRobustCircle, CenterCovarianceMatchesScatter) {
  const Circle truth{{300, 200}, 40};
  for (const double arc_rad : {2 * pi, pi}) {
    Random random(5);
    constexpr int draws = 2000;
    double sum = 0;
    for (int i = 0; i < draws; ++i) {
      const auto fit = fit_circle_to(with_noise(arc(truth, 0, arc_rad, 80), 0.1, random));
      ASSERT_TRUE(fit);
      const Vector2d error = fit->center - truth.center;
      sum += error.dot(fit->center_covariance.llt().solve(error));
    }
    // Chi-square with two degrees of freedom has the mean 2, known within 0.14 (3 sigma) for 2000
    // draws. The covariance is itself estimated from 80 points, which adds a few percent.
    EXPECT_NEAR(sum / draws, 2.06, 0.2) << arc_rad;
  }
}

TEST(FitRobustCircle, CenterFollowsPointsWithLargeWeights) {
  // Two parts that differ slightly: the one with large weights determines the fit.
  const Circle heavy{{300, 200}, 40};
  Points points = arc(heavy, 0, 1.5 * pi, 90);
  std::vector<double> weights(90, 1);
  for (const Vector2d& point : arc({{300, 200}, 40.3}, 1.5 * pi, 2 * pi, 90)) {
    points.push_back(point), weights.push_back(1e-4);
  }
  const auto fit = fit_robust_circle(points, weights, kTolerance);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->center, IsNear(heavy.center, 1e-3));
  EXPECT_GT((fit_circle_to(points).value().center - heavy.center).norm(), 0.02);
}

TEST(FitRobustCircle, ReturnsIdenticalFitWhenRepeated) {
  Random random(3);
  const Points points =
      with_line(with_noise(arc({{300, 200}, 40}, 0, 4, 60), 0.1, random), 30, {0, 0}, {300, 200});
  const auto first_fit = fit_circle_to(points), second_fit = fit_circle_to(points);
  ASSERT_TRUE(first_fit && second_fit);
  EXPECT_EQ(first_fit->center, second_fit->center);
  EXPECT_EQ(first_fit->to_circle().radius, second_fit->to_circle().radius);
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

struct Ellipse {
  Vector2d center;
  double a, b, angle_rad;

  Eigen::Matrix2d rim_from_circle() const {
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
    return turn * Vector2d(a, b).asDiagonal() * turn.transpose();
  }
  Points points(std::size_t count, double from_rad = 0, double to_rad = 2 * pi) const {
    Points points = arc({{0, 0}, 1}, from_rad, to_rad, count);
    for (Vector2d& point : points) point = center + rim_from_circle() * point;
    return points;
  }
};

/// 40 px large in the mean.
Ellipse ellipse_of(double axis_ratio, double angle_rad) {
  const double root = std::sqrt(axis_ratio);
  return {{300.2, 199.7}, 40 * root, 40 / root, angle_rad};
}

std::optional<RobustEllipse> ellipse_of(const Points& points) {
  return fit_robust_ellipse(points, std::vector<double>(points.size(), 1), 0.35);
}

void expect_found(const Points& points, const Ellipse& truth, double within, int count) {
  const auto fit = ellipse_of(points);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->center, IsNear(truth.center, within));
  EXPECT_THAT(fit->rim_from_circle, IsNear(truth.rim_from_circle(), within));
  EXPECT_EQ(fit->count, count);
  EXPECT_EQ(std::count(fit->inliers.begin(), fit->inliers.end(), true), count);
}

TEST(FitRobustEllipse, RecoversEllipseFromExactPoints) {
  for (const double ratio : {1.0, 1.03, 1.08, 1.15}) {
    for (int degrees = 0; degrees < 180; degrees += 15) {
      SCOPED_TRACE(testing::Message() << ratio << " at " << degrees);
      const Ellipse truth = ellipse_of(ratio, degrees * pi / 180);
      expect_found(truth.points(100), truth, 1e-6, 100);
      expect_found(truth.points(80, 1, 1 + 1.5 * pi), truth, 1e-4, 80);
    }
  }
}

TEST(FitRobustEllipse, RecoversEllipseDespiteThirtyPercentOutliers) {
  Random random(4);
  for (const double ratio : {1.0, 1.07, 1.15}) {
    for (const int outliers : {10, 20, 30}) {
      for (int degrees = 0; degrees < 180; degrees += 30) {
        SCOPED_TRACE(testing::Message() << ratio << ", " << outliers << " % at " << degrees);
        const Ellipse truth = ellipse_of(ratio, degrees * pi / 180);
        Points points = truth.points(std::size_t(100 - outliers));
        for (int i = 0; i < outliers; ++i) {  // at 0.3 to 0.9 of the radius, or outside
          const double angle = random.uniform(0, 2 * pi), away = random.uniform(0.3, 0.9);
          const Vector2d rim = truth.rim_from_circle() * Vector2d(std::cos(angle), std::sin(angle));
          points.push_back(truth.center + (i % 3 == 0 ? 2 - away : away) * rim);
        }
        expect_found(points, truth, 1e-4, 100 - outliers);
      }
    }
  }
}

TEST(FitRobustEllipse, CenterCovarianceMatchesScatter) {
  for (const double ratio : {1.0, 1.1}) {
    const Ellipse truth = ellipse_of(ratio, 0.6);
    for (const double arc_rad : {2 * pi, 1.3 * pi}) {
      Random random(5);
      constexpr int draws = 2000;
      double sum = 0;
      for (int i = 0; i < draws; ++i) {
        const auto fit = ellipse_of(with_noise(truth.points(80, 0, arc_rad), 0.1, random));
        ASSERT_TRUE(fit);
        const Vector2d error = fit->center - truth.center;
        sum += error.dot(fit->center_covariance.llt().solve(error));
      }
      // Chi-square with two degrees of freedom has the mean 2, known within 0.14 (3 sigma) for 2000
      // draws. The covariance is itself estimated from 80 points, which adds a few percent.
      EXPECT_NEAR(sum / draws, 2.06, 0.2) << ratio << ", " << arc_rad;
    }
  }
}

TEST(FitRobustEllipse, CenterAndAreaMatchOpenCvWithoutOutliers) {
  Random random(8);
  for (int degrees = 0; degrees < 180; degrees += 20) {
    const Ellipse truth = ellipse_of(1.12, degrees * pi / 180);
    const Points points = with_noise(truth.points(150), 0.1, random);
    const auto fit = ellipse_of(points);
    std::vector<cv::Point2f> pixels;
    for (const Vector2d& point : points) pixels.emplace_back(float(point.x()), float(point.y()));
    const cv::RotatedRect oracle = cv::fitEllipseDirect(pixels);
    ASSERT_TRUE(fit);
    // Each is within 0.1 / sqrt(75) = 0.012 of the truth.
    EXPECT_THAT(fit->center, IsNear(Vector2d(oracle.center.x, oracle.center.y), 0.012));
    EXPECT_NEAR(fit->rim_from_circle.determinant(), oracle.size.area() / 4, 2) << "of 1600";
  }
}

TEST(FitRobustEllipse, CenterIsAsAccurateAsCircleFitForCircles) {
  Random random(9);
  const Circle truth{{300, 200}, 40};
  double circle_squares = 0, ellipse_squares = 0;
  for (int i = 0; i < 500; ++i) {
    const Points points = with_noise(arc(truth, 0, 2 * pi, 80), 0.1, random);
    const auto circle = fit_robust_circle(points, std::vector<double>(80, 1), 0.35);
    const auto ellipse = ellipse_of(points);
    ASSERT_TRUE(circle && ellipse);
    circle_squares += (circle->center - truth.center).squaredNorm();
    ellipse_squares += (ellipse->center - truth.center).squaredNorm();
    EXPECT_THAT(ellipse->center, IsNear(circle->center, 0.02));
  }
  EXPECT_NEAR(ellipse_squares / circle_squares, 1, 0.05);
}

TEST(FitRobustEllipse, ReturnsNulloptForLessThanSevenInliers) {
  const Ellipse truth = ellipse_of(1.05, 0.3);
  for (const std::size_t count : {0U, 1U, 4U, 5U, 6U})
    EXPECT_FALSE(ellipse_of(truth.points(count)));
  EXPECT_TRUE(ellipse_of(truth.points(7)));
  EXPECT_FALSE(ellipse_of(Points(20, Vector2d(3, 4))));
  EXPECT_FALSE(ellipse_of({{0, 0}, {3, 2}, {6, 4}, {9, 6}, {12, 8}, {15, 10}, {18, 12}, {21, 14}}));
}

TEST(FitSlenderEllipse, RecoversEllipseFromExactPoints) {
  for (const double ratio : {1.0, 3.0, 6.0, 12.0}) {
    for (const double degrees : {0.0, 30.0, 90.0, 140.0}) {
      const Ellipse truth = ellipse_of(ratio, degrees * pi / 180);
      const Points points = truth.points(80);
      const auto fit = fit_elongated_ellipse(points, std::vector<double>(points.size(), 1), 0.35);
      ASSERT_TRUE(fit) << ratio << " " << degrees;
      EXPECT_THAT(fit->center, IsNear(truth.center, 1e-9));
      EXPECT_THAT(fit->rim_from_circle, IsNear(truth.rim_from_circle(), 1e-8));
    }
  }
  EXPECT_FALSE(fit_elongated_ellipse({}, {}, 0.35));
  const Points line{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {5, 5}, {6, 6}, {7, 7}};
  EXPECT_FALSE(fit_elongated_ellipse(line, std::vector<double>(line.size(), 1), 0.35));
}

TEST(FitSlenderEllipse, CenterCovarianceMatchesScatter) {
  Random random(9);
  const Ellipse truth = ellipse_of(6, 0.6);
  double chi_square = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    const Points points = with_noise(truth.points(80), 0.1, random);
    const auto fit = fit_elongated_ellipse(points, std::vector<double>(points.size(), 1), 0.35);
    ASSERT_TRUE(fit);
    const Vector2d error = fit->center - truth.center;
    chi_square += error.dot(fit->center_covariance.ldlt().solve(error)) / (2 * trials);
  }
  EXPECT_GT(chi_square, 0.6);
  EXPECT_LT(chi_square, 2);
}

}  // namespace
}  // namespace vlp
