// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/statistical_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace vlp {
namespace {

constexpr double kSigmas[] = {1.96, 3, kSigmasOfOneInTenThousand, 4.5};
constexpr double kDegreesOfFreedom[] = {2, 3, 5, 8, 12, 30, 100};

/// Integrates a density from `from` > 0 to infinity, over x = from / u with Simpson's rule.
template <typename Density>
double integrate_tail(double from, const Density& density) {
  constexpr int intervals = 20000;
  double sum = 0;
  for (int i = 1; i <= intervals; ++i) {  // the density is 0 where u is
    const double u = static_cast<double>(i) / intervals;
    const double weight = i == intervals ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * density(from / u) * from / (u * u);
  }
  return sum / (3.0 * intervals);
}

double normal_upper_tail(double sigmas) { return std::erfc(sigmas / std::numbers::sqrt2) / 2; }

/// Returns the sigmas whose normal_upper_tail() this is.
double find_sigmas(double tail) {
  double low = 0, high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (normal_upper_tail(middle) > tail ? low : high) = middle;
  }
  return low;
}

double student_upper_tail(double t, double m) {
  const double scale =
      std::exp(std::lgamma((m + 1) / 2) - std::lgamma(m / 2)) / std::sqrt(m * std::numbers::pi);
  return integrate_tail(t, [&](double x) { return scale * std::pow(1 + x * x / m, -(m + 1) / 2); });
}

double chi_squared_upper_tail(double chi_squared, double m) {
  const double log_scale = -m / 2 * std::numbers::ln2 - std::lgamma(m / 2);
  return integrate_tail(chi_squared, [&](double x) {
    return std::exp(log_scale + (m / 2 - 1) * std::log(x) - x / 2);
  });
}

TEST(SigmasOfOneInTenThousand, MatchesUpperTailOfNormalDistribution) {
  EXPECT_NEAR(normal_upper_tail(kSigmasOfOneInTenThousand), 1e-4, 1e-7);
}

TEST(ComputeSquaredTBound, IsExceededAsRarelyAsSigmasOfNormalDistribution) {
  for (const double sigmas : {1.0, 1.96, 3.0, kSigmasOfOneInTenThousand, 4.5}) {
    for (const double m : kDegreesOfFreedom) {
      const double tail = student_upper_tail(std::sqrt(compute_squared_t_bound(sigmas, m)), m);
      EXPECT_GT(find_sigmas(tail), sigmas - 0.01) << m;
      EXPECT_LT(find_sigmas(tail), sigmas + (m < 8 ? 0.3 : 0.03)) << m;
    }
  }
}

TEST(ComputeChiSquaredBound, IsExceededAsRarelyAsSigmasOfNormalDistribution) {
  for (const double sigmas : kSigmas) {
    for (const double m : kDegreesOfFreedom) {
      const double tail = chi_squared_upper_tail(compute_chi_squared_bound(sigmas, m), m);
      EXPECT_GT(find_sigmas(tail), sigmas - 0.01) << m;
      EXPECT_LT(find_sigmas(tail), sigmas + 0.25) << m;
    }
  }
}

TEST(StatisticalBounds, ApproachSigmasOfNormalDistributionForManyDegreesOfFreedom) {
  constexpr double m = 1e9;
  for (const double sigmas : kSigmas) {
    EXPECT_NEAR(compute_squared_t_bound(sigmas, m), sigmas * sigmas, 1e-6);
    EXPECT_NEAR((compute_chi_squared_bound(sigmas, m) - m) / std::sqrt(2 * m), sigmas, 1e-3);
  }
}

}  // namespace
}  // namespace vlp
