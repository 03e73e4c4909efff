// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The covariance that each method reports, against the scatter of what it finds.
#include <gmock/gmock.h>

#include <cmath>

#include "calibration/rotation/circle_center.h"
#include "calibration/rotation/joint_center.h"
#include "calibration/rotation/planar_scatter.h"
#include "calibration/rotation/spot.h"
#include "calibration/rotation/turning_axis.h"
#include "geometry/angles.h"
#include "support/near.h"

namespace vlp {
namespace {

constexpr int kDraws = 300;
constexpr double kNoise_px = 0.3;

RotationFit mean_circle(const SpotCaptures& spot, const Camera& camera) {
  return fit_circle_centers(spot, camera).mean;
}

using Method = RotationFit (*)(const SpotCaptures&, const Camera&);

RotationFit drawn(const SpotScene& scene, const std::vector<Frame>& frames, Method method,
                  Random& random) {
  const SpotCaptures spot = spot_captures(with_noise(frames, random), scene.map, scene.camera);
  EXPECT_EQ(spot.status, SpotStatus::ok);
  const RotationFit fit = method(spot, scene.camera);
  EXPECT_TRUE(fit.converged && fit.center.covariance);
  return fit;
}

/// Standard deviations of 300 draws are good to 4 %, the share of 5 % beyond to 1.3 %.
void expect_consistent(const PlanarScatter& scatter) {
  EXPECT_THAT(scatter.excess(), IsNear(Eigen::Vector2d::Zero(), 0.14));
  EXPECT_NEAR(scatter.share_beyond_95(), 0.05, 0.04);
}

void expect_consistent(const SpotScene& scene, Method method, bool unbiased) {
  Random random(7);
  const auto frames = scene.frames(kNoise_px);
  const SpotCaptures exact = spot_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(exact.status, SpotStatus::ok);
  PlanarScatter scatter(method(exact, scene.camera).center.center_px);
  for (int i = 0; i < kDraws; ++i) {
    const RotationFit fit = drawn(scene, frames, method, random);
    scatter.add(fit.center.center_px, *fit.center.covariance);
  }
  expect_consistent(scatter);
  if (unbiased) {
    EXPECT_THAT(scatter.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
  }
}

SpotScene level_scene() {
  SpotScene scene;
  scene.lever_arm_m = {0.012, -0.009};
  return scene;
}

/// Through a pinhole, where the undistorted image of `circle` is the image. 300 draws of 24 degrees
/// of freedom or more know a standard deviation to 1 %.
TEST(RotationScatter, ResidualsAreTheNoisePerAxis) {
  SpotScene scene;  // without a lever arm, which `axis` at one height takes for a tilt
  scene.camera.lens_model = LensModel::pinhole;
  scene.camera.intrinsics.resize(4);
  scene.captures = 5;           // few, so that degrees of freedom count
  scene.only_in_image = false;  // or some circle has three points
  scene.arc_rad = 5;
  for (const Method method : {&mean_circle, &fit_joint_center, &fit_turning_axis}) {
    Random random(9);
    const auto frames = scene.frames(kNoise_px);
    double squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      const RotationFit fit = drawn(scene, frames, method, random);
      squares += fit.residual_px * fit.residual_px / kDraws;
    }
    EXPECT_NEAR(std::sqrt(squares) / kNoise_px, 1, 0.05);
  }
}

TEST(RotationScatter, OfTheMeanCircle) { expect_consistent(level_scene(), mean_circle, false); }

TEST(RotationScatter, OfTheJointCenter) {
  expect_consistent(level_scene(), fit_joint_center, true);
}

TEST(RotationScatter, OfTheAxis) {
  expect_consistent(tilted_scene({0, 0}), fit_turning_axis, true);
}

TEST(RotationScatter, OfTheAxisFromHalfATurn) {
  SpotScene scene = tilted_scene({0, 0});
  scene.arc_rad = 3;
  expect_consistent(scene, fit_turning_axis, true);
}

TEST(RotationScatter, OfTheAxisFromTwoLamps) {
  SpotScene scene = tilted_scene({0, 0});
  scene.map.lamps.resize(2);
  scene.map.lamps[1].position_m = {0.5, 0.4, 1.6};
  expect_consistent(scene, fit_turning_axis, true);
}

TEST(RotationScatter, OfAxisAndLeverArmFromTwoHeights) {
  SpotScene scene = tilted_scene({0, 0});
  scene.heights_m = {0, 0.3};
  scene.lever_arm_m = {0.012, -0.009};
  Random random(8);
  const auto frames = scene.frames(kNoise_px);
  PlanarScatter center(scene.truth().center_px), lever_arm(scene.lever_arm_m);
  for (int i = 0; i < kDraws; ++i) {
    const RotationFit fit = drawn(scene, frames, fit_turning_axis, random);
    ASSERT_TRUE(fit.center.lever_arm_covariance);
    center.add(fit.center.center_px, *fit.center.covariance);
    lever_arm.add(*fit.center.lever_arm_m, *fit.center.lever_arm_covariance);
  }
  expect_consistent(center);
  expect_consistent(lever_arm);
  EXPECT_THAT(center.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
  EXPECT_THAT(lever_arm.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
}

}  // namespace
}  // namespace vlp
