// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_model.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <vector>

#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the exact fix A + R(yaw) (e + H delta). Its height z has no effect.
RotationFix make_exact_fix(const Eigen::Vector2d& axis_m, const Eigen::Vector2d& lever_arm_m,
                           const Eigen::Vector2d& delta, double yaw_rad, double height_m,
                           std::size_t pivot) {
  const Eigen::Vector2d position_m =
      axis_m + Eigen::Rotation2Dd(yaw_rad) * (lever_arm_m + height_m * delta);
  return {{{position_m.x(), position_m.y(), 7.5}, yaw_rad}, height_m, pivot};
}

TEST(FitRotationModel, ReturnsExactAxesDeltaAndLeverArmForTwoPivots) {
  const std::vector<Eigen::Vector2d> axes_m = {{0.3, -0.7}, {-1.1, 0.4}};
  const Eigen::Vector2d lever_arm_m(0.12, -0.05), delta(0.03, 0.02);
  std::vector<RotationFix> fixes;
  for (int k = 0; k < 10; ++k) {
    const std::size_t pivot = k < 4 ? 0 : 1;
    fixes.push_back(
        make_exact_fix(axes_m[pivot], lever_arm_m, delta, 0.7 * k, pivot == 0 ? 2.5 : 1.5, pivot));
  }
  const RotationModelFit fit = fit_rotation_model(fixes, 2, true);
  ASSERT_EQ(fit.axes_m.size(), 2U);
  EXPECT_THAT(fit.axes_m[0], IsNear(axes_m[0], 1e-12));
  EXPECT_THAT(fit.axes_m[1], IsNear(axes_m[1], 1e-12));
  EXPECT_THAT(fit.lever_arm_m, IsNear(lever_arm_m, 1e-12));
  EXPECT_THAT(fit.delta, IsNear(delta, 1e-12));
  ASSERT_EQ(fit.residuals_m.size(), 10U);
  EXPECT_LT(*std::max_element(fit.residuals_m.begin(), fit.residuals_m.end()), 1e-12);
}

TEST(FitRotationModel, DeltaIncludesLeverArmDividedByHeightWithoutLeverArm) {
  const Eigen::Vector2d axis_m(0.3, -0.7), lever_arm_m(0.12, -0.05), delta(0.03, 0.02);
  std::vector<RotationFix> fixes;
  for (int k = 0; k < 5; ++k) {
    fixes.push_back(make_exact_fix(axis_m, lever_arm_m, delta, 1.1 * k, 2.5, 0));
  }
  const RotationModelFit fit = fit_rotation_model(fixes, 1, false);
  ASSERT_EQ(fit.axes_m.size(), 1U);
  EXPECT_THAT(fit.axes_m[0], IsNear(axis_m, 1e-12));
  EXPECT_THAT(fit.delta, IsNear(delta + lever_arm_m / 2.5, 1e-12));
  EXPECT_EQ(fit.lever_arm_m, Eigen::Vector2d(0, 0));
}

/// One fix at yaw 0 and height 2 determines only A + 2 delta.
TEST(FitRotationModel, ReturnsSolutionOfMinimumNormForOneFix) {
  const std::vector<RotationFix> fixes = {{{{3, 1, 0}, 0}, 2, 0}};
  const RotationModelFit fit = fit_rotation_model(fixes, 1, false);
  ASSERT_EQ(fit.axes_m.size(), 1U);
  EXPECT_THAT(fit.axes_m[0], IsNear(Eigen::Vector2d(0.6, 0.2), 1e-12));
  EXPECT_THAT(fit.delta, IsNear(Eigen::Vector2d(1.2, 0.4), 1e-12));
  const RotationModelFit with_arm = fit_rotation_model(fixes, 1, true);
  EXPECT_THAT(with_arm.lever_arm_m, IsNear(Eigen::Vector2d(0.5, 1. / 6), 1e-12));
}

TEST(MeasureArc, ReturnsZeroForFewerThanTwoAngles) {
  EXPECT_EQ(measure_arc({}), 0);
  EXPECT_EQ(measure_arc({1.5}), 0);
}

TEST(MeasureArc, ReturnsFullTurnMinusLargestGap) {
  constexpr double turn = 2 * std::numbers::pi;
  EXPECT_NEAR(measure_arc({0.5, 0.5}), 0, 1e-12);
  EXPECT_NEAR(measure_arc({1.25, 0.5}), 0.75, 1e-12);
  EXPECT_NEAR(measure_arc({3, -3}), turn - 6, 1e-12) << "gap within the sorted angles";
  EXPECT_NEAR(measure_arc({4.5, 0.1, 2}), turn - 2.5, 1e-12);
  EXPECT_NEAR(measure_arc({0.1, 2.6, 4.5}), turn - 2.5, 1e-12);
  EXPECT_NEAR(measure_arc({0.1, 1, 2, 3}), 2.9, 1e-12) << "gap across zero";
  EXPECT_NEAR(measure_arc({0.2 + 2 * turn, 1.2 - turn, 0.7}), 1, 1e-12);
  EXPECT_NEAR(measure_arc({-0.25, 0.5}), 0.75, 1e-12);
}

}  // namespace
}  // namespace vlp
