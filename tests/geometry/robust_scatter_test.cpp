// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/robust_scatter.h"

#include <gtest/gtest.h>

#include "support/random.h"

namespace vlp {
namespace {

std::vector<double> draw_squares(Random& random, std::size_t count, double sigma) {
  std::vector<double> squares;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = sigma * random.normal(), y = sigma * random.normal();
    squares.push_back(x * x + y * y);
  }
  return squares;
}

TEST(EstimateVariance2d, MatchesVariancePerAxisOfNormalSamples) {
  Random random(1);
  const double variance = estimate_variance_2d(draw_squares(random, 20000, 3), 2 * 20000);
  EXPECT_NEAR(variance / 9, 1, 0.03);
}

TEST(EstimateVariance2d, IsInverselyProportionalToDegreesOfFreedom) {
  const std::vector<double> squares(10, 1.0);
  EXPECT_DOUBLE_EQ(estimate_variance_2d(squares, 5), 4 * estimate_variance_2d(squares, 20));
}

TEST(ComputeOutlierBound2d, ApproachesSigmasSquaredForManyDegreesOfFreedom) {
  EXPECT_NEAR(compute_outlier_bound_2d(4.5, 1e6), 4.5 * 4.5, 1e-3);
  EXPECT_GT(compute_outlier_bound_2d(4.5, 16), 50);
}

/// A bound of 2.5 sigmas, which 4.4 % of the residuals exceed where the variance is known, is
/// exceeded often enough to be counted. The median of few is biased upwards, so that fewer exceed
/// it.
TEST(ComputeOutlierBound2d, IsExceededAtMostAtNominalRateForSmallSamples) {
  constexpr double sigmas = 2.5;
  const double expected = std::exp(-sigmas * sigmas / 2);
  for (const std::size_t count : {5U, 9U, 15U, 41U}) {
    Random random(2);
    constexpr int runs = 20000;
    int beyond = 0;
    for (int run = 0; run < runs; ++run) {
      // The residual is not one of those that the variance is from.
      const double freedom = 2 * static_cast<double>(count);
      const double variance = estimate_variance_2d(draw_squares(random, count, 1), freedom);
      const double square = draw_squares(random, 1, 1).front();
      beyond += square > compute_outlier_bound_2d(sigmas, freedom) * variance ? 1 : 0;
    }
    EXPECT_GT(beyond / expected / runs, 0.5) << count;
    EXPECT_LT(beyond / expected / runs, 1.15) << count;
  }
}

}  // namespace
}  // namespace vlp
