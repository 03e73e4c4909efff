// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <numbers>

#include "geometry/arc.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kTrials = 8000;
constexpr std::size_t kPoints = 10;  // few: dividing by n - 3 differs clearly from n or n - 2

struct Scatter {
  Vector2d mean_error = Vector2d::Zero();
  Matrix2d covariance = Matrix2d::Zero();           // of the centers found
  Matrix2d reported_covariance = Matrix2d::Zero();  // their mean
  double mahalanobis_squared = 0;                   // mean of e^T C^-1 e, with the C reported
};

Scatter simulate_scatter(double arc_rad, double sigma, std::uint64_t seed) {
  Random random(seed);
  const Circle truth{{0.3, -0.1}, 2};
  const Points points = arc(truth, 0.4, 0.4 + arc_rad, kPoints);
  Scatter scatter;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto fit = fit_circle(with_noise(points, sigma, random));
    EXPECT_TRUE(fit && fit->converged);
    if (!fit) return {};
    const Vector2d error = fit->circle.center - truth.center;
    const Matrix2d reported = fit->center_covariance;
    scatter.mean_error += error / kTrials;
    scatter.covariance += error * error.transpose() / kTrials;
    scatter.reported_covariance += reported / kTrials;
    scatter.mahalanobis_squared += error.dot(reported.ldlt().solve(error)) / kTrials;
  }
  return scatter;
}

class FitCircleMonteCarlo : public testing::TestWithParam<double> {
 protected:
  // The noise is a thousandth of the arc's sagitta, so that the bias of the geometric fit, which
  // goes with the square of the noise, is far below the scatter of the mean.
  const double arc_rad_ = GetParam();
  const Scatter scatter_ = simulate_scatter(arc_rad_, 1e-3 * arc_rad_ * arc_rad_ / 8, 7);
};

TEST_P(FitCircleMonteCarlo, CenterIsUnbiased) {
  // e^T C^-1 e of a mean of N is chi-square with two degrees of freedom over N; 20 is its
  // quantile of 1 - 5e-5.
  const Vector2d& e = scatter_.mean_error;
  EXPECT_LT(kTrials * e.dot(scatter_.covariance.ldlt().solve(e)), 20);
}

TEST_P(FitCircleMonteCarlo, MeanNormalizedCenterErrorMatchesReportedCovariance) {
  // With the scatter estimated from the same n points, e^T C^-1 e / 2 is F(2, n - 3), whose mean
  // is (n - 3) / (n - 5). Its mean over 8000 trials has a standard deviation of 0.05.
  const double freedom = static_cast<double>(kPoints) - 3;
  EXPECT_NEAR(scatter_.mahalanobis_squared, 2 * freedom / (freedom - 2), 0.24);
}

TEST_P(FitCircleMonteCarlo, CenterScatterMatrixMatchesReportedCovariance) {
  // In units of the reported covariance the covariance found is the identity; an entry of it has
  // a standard deviation of sqrt(2 / 8000) = 0.016 at most.
  const Matrix2d root = scatter_.reported_covariance.llt().matrixL();
  const Matrix2d inverse = root.inverse();
  EXPECT_THAT(inverse * scatter_.covariance * inverse.transpose(),
              IsNear(Matrix2d::Identity(), 0.08));
}

INSTANTIATE_TEST_SUITE_P(Arcs, FitCircleMonteCarlo,
                         testing::Values(0.35, 1.0, std::numbers::pi, 2 * std::numbers::pi));

TEST(FitCircle, RadiusIsUnbiasedForNoisyShortArcs) {
  // 60 degrees with a noise of a tenth of the sagitta: an algebraic (Kasa) fit is 8 % too small
  // here.
  Random random(8);
  const Circle truth{{0, 0}, 1};
  const Points points = arc(truth, 0, std::numbers::pi / 3, 40);
  double mean_radius = 0;
  constexpr int kLoudTrials = 500;
  for (int trial = 0; trial < kLoudTrials; ++trial) {
    const auto fit = fit_circle(with_noise(points, 0.0134, random));
    ASSERT_TRUE(fit && fit->converged);
    mean_radius += fit->circle.radius / kLoudTrials;
  }
  EXPECT_NEAR(mean_radius, 1, 0.02);
}

}  // namespace
}  // namespace vlp
