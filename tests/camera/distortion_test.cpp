// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/distortion.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "camera/random_lens.h"
#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

/// Creates a distortion with one coefficient; `index` counts k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.
Distortion only(std::size_t index, double value) {
  Distortion distortion;
  distortion.k[index] = value;
  return distortion;
}

Distortion random_distortion(Random& random) {
  Distortion distortion;
  for (std::size_t i = 0; i < 12; ++i) {
    const bool radial = i < 2 || (i >= 4 && i < 8);
    distortion.k[i] = (radial ? 0.1 : 0.01) * random.uniform(-1, 1);
  }
  return distortion;
}

double smallest_determinant(const Distortion& distortion, double radius) {
  double smallest = kInfinity;
  for (int degree = 0; degree < 360; ++degree) {
    const double around_rad = degree * 0.0174533;
    const Vector2d z = radius * Vector2d(std::cos(around_rad), std::sin(around_rad));
    smallest = std::min(smallest, distortion(z).d_distorted_d_z.determinant());
  }
  return smallest;
}

TEST(Distortion, ReturnsInputForZeroCoefficients) {
  const auto value = Distortion{}({0.3, -0.7});
  EXPECT_EQ(value.distorted, Vector2d(0.3, -0.7));
  EXPECT_EQ(value.d_distorted_d_z, Eigen::Matrix2d::Identity());
}

TEST(Distortion, MatchesClosedFormOfEachSingleCoefficient) {
  // At z = (1, 2), r2 = 5.
  const double expected[12][2] = {
      {1 * 5, 2 * 5},                // k1: z r2
      {1 * 25, 2 * 25},              // k2: z r4
      {2 * 1 * 2, 5 + 2 * 4},        // p1: 2xy, r2 + 2 y2
      {5 + 2 * 1, 2 * 1 * 2},        // p2: r2 + 2 x2, 2xy
      {1 * 125, 2 * 125},            // k3: z r6
      {1 / 1.05 - 1, 2 / 1.05 - 2},  // k4 to k6 in the denominator, here times 0.01
      {1 / 1.25 - 1, 2 / 1.25 - 2},  //
      {1 / 2.25 - 1, 2 / 2.25 - 2},  //
      {5, 0},
      {25, 0},
      {0, 5},
      {0, 25}  // s1 to s4: r2, r4 on x, then on y
  };
  for (std::size_t i = 0; i < 12; ++i) {
    const bool denominator = i >= 5 && i < 8;
    const Vector2d shift = only(i, 0.01)({1, 2}).distorted - Vector2d(1, 2);
    const Vector2d term(expected[i][0], expected[i][1]);
    EXPECT_THAT(shift, IsNear((denominator ? 1 : 0.01) * term, 1e-15)) << i;
  }
}

TEST(Distortion, JacobiansMatchDifferenceQuotients) {
  Random random(41);
  constexpr double step = 1e-6;  // rounding leaves 1e-9
  for (int trial = 0; trial < 500; ++trial) {
    const Distortion distortion = random_distortion(random);
    const Vector2d z(random.uniform(-1, 1), random.uniform(-1, 1));
    Eigen::Matrix2d by_z;
    for (int i = 0; i < 2; ++i) {
      const Vector2d h = step * Vector2d::Unit(i);
      by_z.col(i) = (distortion(z + h).distorted - distortion(z - h).distorted) / (2 * step);
    }
    EXPECT_THAT(distortion(z).d_distorted_d_z, IsNear(by_z, 1e-8));
    Eigen::Matrix<double, 2, 12> by_k;
    for (std::size_t i = 0; i < 12; ++i) {
      Distortion more = distortion, less = distortion;
      more.k[i] += step;
      less.k[i] -= step;
      by_k.col(static_cast<Eigen::Index>(i)) = (more(z).distorted - less(z).distorted) / (2 * step);
    }
    EXPECT_THAT(distortion.coefficient_jacobian(z), IsNear(by_k, 1e-8));
  }
}

TEST(ComputeMaxRadius, MatchesClosedFormForSingleCoefficient) {
  const double tolerance = 2e-12;  // it is bisected to 1e-12
  for (const double k1 : {-0.0334, -0.1, -0.3, -0.4, -1.5, -100.0}) {
    EXPECT_NEAR(only(0, k1).compute_max_radius(), 1 / std::sqrt(-3 * k1), tolerance) << k1;
  }
  EXPECT_NEAR(only(1, -0.1).compute_max_radius(), std::pow(0.5, -0.25), tolerance);
  EXPECT_NEAR(only(4, -0.1).compute_max_radius(), std::pow(0.7, -1 / 6.0), tolerance);
  // r / (1 + k r^2) turns round at k r^2 = 1 and has a pole at k r^2 = -1.
  EXPECT_NEAR(only(5, 0.25).compute_max_radius(), 2, tolerance);
  EXPECT_NEAR(only(5, -0.25).compute_max_radius(), 2, tolerance);
  // Outwards against the decentering the point moves by 1 - 6 r |p|, against the prism by
  // 1 - 2 r s1 - 4 r^3 s2.
  EXPECT_NEAR(only(2, 0.05).compute_max_radius(), 1 / 0.3, tolerance);
  EXPECT_NEAR(only(3, -0.05).compute_max_radius(), 1 / 0.3, tolerance);
  EXPECT_NEAR(only(8, 0.1).compute_max_radius(), 5, tolerance);
  EXPECT_NEAR(only(10, -0.1).compute_max_radius(), 5, tolerance);
  EXPECT_NEAR(only(9, 0.25).compute_max_radius(), 1, tolerance);
  EXPECT_NEAR(only(11, -0.25).compute_max_radius(), 1, tolerance);
}

TEST(ComputeMaxRadius, ReturnsInfinityWithoutFold) {
  EXPECT_EQ(Distortion{}.compute_max_radius(), kInfinity);
  for (const std::size_t radial : {0U, 1U, 4U}) {
    EXPECT_EQ(only(radial, 0.3).compute_max_radius(), kInfinity) << radial;
  }
  EXPECT_EQ(only(0, -0.0033).compute_max_radius(), kInfinity);  // folds at 10.05
}

TEST(ComputeMaxRadius, ReturnsRadiusOfFirstOfTwoFolds) {
  // 1 + 3 k1 r^2 + 5 k2 r^4 has two roots: the radius grows again after the second.
  Distortion distortion = only(0, -0.4);
  distortion.k[1] = 0.06;
  const double first = (1.2 - std::sqrt(1.44 - 1.2)) / 0.6;
  EXPECT_NEAR(distortion.compute_max_radius(), std::sqrt(first), 2e-12);
}

TEST(ComputeMaxRadius, MatchesFirstSignChangeOfJacobianDeterminant) {
  Random random(42);
  int folds = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Distortion distortion = random_distortion(random);
    const double radius = distortion.compute_max_radius();
    if (radius == kInfinity) continue;
    for (const double fraction : {0.1, 0.5, 0.9, 0.99}) {
      ASSERT_GT(smallest_determinant(distortion, fraction * radius), 0) << trial;
    }
    const double beyond = smallest_determinant(distortion, 1.01 * radius);
    if (std::abs(beyond) > 10) continue;  // a pole
    ASSERT_LT(beyond, 0) << trial;
    ++folds;
  }
  EXPECT_GT(folds, 100);
}

}  // namespace
}  // namespace vlp
