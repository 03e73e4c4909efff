// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/distributions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

/// The table of NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.4.
TEST(ComputeChiSquareQuantile, MatchesTableOfNist) {
  constexpr double printed = 5e-4;
  EXPECT_NEAR(compute_chi_square_quantile(0.95, 1), 3.841, printed);
  EXPECT_NEAR(compute_chi_square_quantile(0.95, 10), 18.307, printed);
  EXPECT_NEAR(compute_chi_square_quantile(0.975, 10), 20.483, printed);
  EXPECT_NEAR(compute_chi_square_quantile(0.025, 10), 3.247, printed);
  EXPECT_NEAR(compute_chi_square_quantile(0.95, 100), 124.342, printed);
}

/// Values of SciPy 1.10, computed by Cephes and Boost.
TEST(ComputeChiSquareQuantile, MatchesScipy) {
  const auto expect = [](double probability, double dof, double quantile) {
    EXPECT_NEAR(compute_chi_square_quantile(probability, dof) / quantile, 1, 1e-11);
  };
  expect(0.025, 19, 8.906516481987971);
  expect(0.975, 19, 32.85232686172969);
  expect(0.025, 29.661016949152543, 16.538181664930775);
  expect(0.975, 0.5, 3.433235299960771);
  expect(0.5, 1000, 999.333412403381);
  expect(0.001, 3, 0.024297585815692732);
}

/// With two degrees of freedom P(X <= x) is 1 - exp(-x / 2).
TEST(ComputeChiSquareQuantile, MatchesClosedFormForTwoDegreesOfFreedom) {
  for (const double probability : {1e-3, 0.5, 0.975, 0.999999}) {
    EXPECT_NEAR(compute_chi_square_quantile(probability, 2), -2 * std::log1p(-probability), 1e-13);
  }
}

TEST(ComputeFUpperTailProbability, MatchesScipy) {
  const auto expect = [](double x, double above, double below, double tail) {
    EXPECT_NEAR(compute_f_upper_tail_probability(x, above, below) / tail, 1, 1e-11);
  };
  expect(0.4337210301350992, 18, 60, 0.9741064043290475);
  expect(0.7178239716939357, 38, 60, 0.8614344954174649);
  expect(34.44, 2, 18, 7.033544438760917e-07);
  expect(1, 1, 1, 0.5);
  expect(2.5, 7.5, 3.25, 0.2293801822322904);
  EXPECT_EQ(compute_f_upper_tail_probability(0, 3, 4), 1);
}

/// The table of NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.2, and of 58 degrees of
/// freedom AIAG's MSA, 4th ed.
TEST(ComputeTwoTailedTQuantile, MatchesPublishedTables) {
  constexpr double printed = 5e-4;
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.05, 1), 12.706, printed);
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.05, 10), 2.228, printed);
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.01, 10), 3.169, printed);
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.05, 14), 2.145, printed);
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.05, 58), 2.00172, 5e-6);
  EXPECT_NEAR(compute_two_tailed_t_quantile(0.05, 100), 1.984, printed);
}

/// With one degree of freedom it is the Cauchy distribution.
TEST(ComputeTwoTailedTProbability, MatchesCauchyDistributionAndInvertsQuantile) {
  const double pi = std::acos(-1);
  for (const double t : {0.0, 1e-3, 0.5, -2.0, 40.0}) {
    EXPECT_NEAR(compute_two_tailed_t_probability(t, 1), 1 - 2 / pi * std::atan(std::abs(t)), 1e-13);
  }
  EXPECT_NEAR(compute_two_tailed_t_probability(compute_two_tailed_t_quantile(0.3, 7.5), 7.5), 0.3,
              1e-13);
}

}  // namespace
}  // namespace vlp
