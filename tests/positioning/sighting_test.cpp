// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/sighting.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr double kStep = 1e-6;
// Central differences of a smooth function of order one: step^2 and rounding / step.
constexpr double kDifferenceError = 1e-8;

TEST(ProjectLampToNormalizedPoint, MatchesProjectionOfLampInLevelFrame) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(0, 1)},
                    random.uniform(-3, 3)};
    const Eigen::Vector3d lamp(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(2, 4));
    const Eigen::Vector3d x_in_level = level_point_from_world(pose, lamp);
    EXPECT_THAT(project_lamp_to_normalized_point(LevelPose(pose), lamp),
                IsNear(x_in_level.hnormalized(), 1e-14));
  }
}

TEST(ProjectLampWithJacobian, JacobianWrtPoseMatchesFiniteDifferences) {
  const Pose pose{{0.3, -0.7, 0.4}, 2.2};
  const Eigen::Vector3d lamp(1.1, 0.4, 2.5);
  const auto jacobian = project_lamp_with_jacobian(LevelPose(pose), lamp).d_z_d_state;
  for (int i = 0; i < 4; ++i) {
    Pose plus = pose, minus = pose;
    (i < 3 ? plus.position_m[i] : plus.yaw_rad) += kStep;
    (i < 3 ? minus.position_m[i] : minus.yaw_rad) -= kStep;
    const Eigen::Vector2d difference = (project_lamp_to_normalized_point(LevelPose(plus), lamp) -
                                        project_lamp_to_normalized_point(LevelPose(minus), lamp)) /
                                       (2 * kStep);
    EXPECT_THAT(Eigen::Vector2d(jacobian.col(i)), IsNear(difference, kDifferenceError)) << i;
  }
}

TEST(ComputeNormalizedPointJacobianWrtTilt, MatchesFiniteDifferences) {
  const Eigen::Vector2d z(0.6, -0.35);
  const Eigen::Vector3d ray(z.x(), z.y(), 1);
  for (int i = 0; i < 2; ++i) {
    const auto tilted = [&](double angle_rad) -> Eigen::Vector2d {
      return (Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::Unit(i)) * ray).hnormalized();
    };
    const Eigen::Vector2d difference = (tilted(kStep) - tilted(-kStep)) / (2 * kStep);
    EXPECT_THAT(Eigen::Vector2d(compute_normalized_point_jacobian_wrt_tilt(z).col(i)),
                IsNear(difference, kDifferenceError));
  }
}

}  // namespace
}  // namespace vlp
