// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/angles.h"

#include <gtest/gtest.h>

#include <limits>

namespace vlp {
namespace {

using std::numbers::pi;

TEST(Angles, DegreesAndRadiansAreConvertedBothWays) {
  EXPECT_DOUBLE_EQ(rad_from_deg(180), pi);
  EXPECT_DOUBLE_EQ(deg_from_rad(-pi / 2), -90);
  EXPECT_DOUBLE_EQ(deg_from_rad(rad_from_deg(33.3)), 33.3);
}

TEST(WrapAngleRad, KeepsAnglesWithinPiExactly) {
  for (const double angle_rad : {0.0, -0.0, 1e-300, 3.0, -3.0, pi, -pi}) {
    EXPECT_EQ(wrap_angle_rad(angle_rad), angle_rad);
  }
}

TEST(WrapAngleRad, ReturnsSameDirectionWithinPi) {
  for (int tenths = -1000; tenths <= 1000; ++tenths) {
    const double angle_rad = tenths * 0.1;
    const double wrapped = wrap_angle_rad(angle_rad);
    EXPECT_LE(std::abs(wrapped), pi);
    // 100 rad are rounded to 1.4e-14, and 2 pi is off by 2.4e-16 a turn.
    EXPECT_NEAR(std::cos(wrapped), std::cos(angle_rad), 3e-14) << angle_rad;
    EXPECT_NEAR(std::sin(wrapped), std::sin(angle_rad), 3e-14) << angle_rad;
  }
}

TEST(WrapAngleRad, SubtractsFullTurns) {
  EXPECT_NEAR(wrap_angle_rad(2 * pi + 0.25), 0.25, 1e-15);
  EXPECT_NEAR(wrap_angle_rad(-4 * pi - 0.25), -0.25, 2e-15);
  EXPECT_NEAR(wrap_angle_rad(pi + 0.25), 0.25 - pi, 1e-15);
  EXPECT_NEAR(wrap_angle_rad(-pi - 0.25), pi - 0.25, 1e-15);
}

TEST(WrapAngleRad, ReturnsNanForNonFiniteAngle) {
  EXPECT_TRUE(std::isnan(wrap_angle_rad(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(std::isnan(wrap_angle_rad(std::numeric_limits<double>::infinity())));
}

}  // namespace
}  // namespace vlp
