// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Captures at one height or at several: separation of the heights, and its effect on the lever
/// arm.
#include <gmock/gmock.h>

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr int kSeeds = 8;

/// Returns a scene with a ceiling of 2.6 m, where 10 cm are less than 4 % of the distance from the
/// lamps.
RotationScene high_scene() {
  RotationScene scene = tilted_scene();
  for (Lamp& lamp : scene.map.lamps) lamp.position_m *= 2.6 / 1.6;
  return scene;
}

RotationCaptures find_captures(const RotationScene& scene, const std::vector<Frame>& frames) {
  RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok) << describe_status(rotation.status);
  return rotation;
}

TEST(DetectPivots, SeparatesHeightsTenCentimetersApart) {
  RotationScene scene = high_scene();
  scene.heights_m = {0, 0.1};
  for (int seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Random random(static_cast<unsigned>(seed));
    const RotationCaptures rotation = find_captures(scene, with_noise(scene.frames(0.1), random));
    ASSERT_EQ(rotation.heights.size(), 2U);
    EXPECT_EQ(rotation.captures.size(), 24U);
    const RotationFit found = fit_rotation_axis(rotation, scene.camera);
    ASSERT_TRUE(found.converged && found.covariance);
    const double sd_rad = std::sqrt(found.covariance->topLeftCorner<2, 2>().trace() / 2);
    EXPECT_LT(sd_rad, rad_from_deg(0.1));
    // For 8 draws of a planar normal distribution, none exceeds five standard deviations.
    EXPECT_LT(angle_between(found.center.zenith_in_camera, scene.truth().zenith_in_camera),
              5 * sd_rad);
  }
}

/// Noise of 1 px causes height errors of 1 % of the distance for fixes of two lamps.
TEST(DetectPivots, ReturnsOneHeightUnderNoiseOfOnePixel) {
  for (const std::size_t lamps : {std::size_t{2}, std::size_t{8}}) {
    RotationScene scene = tilted_scene();
    scene.map.lamps.resize(lamps);
    if (lamps == 2) scene.map = make_lamp_map({{-0.3, -0.25, 1.6}, {0.2, 0.2, 1.6}});
    scene.captures = 24;
    for (int seed = 0; seed < kSeeds; ++seed) {
      SCOPED_TRACE(testing::Message() << lamps << " lamps, seed " << seed);
      Random random(static_cast<unsigned>(seed));
      const RotationCaptures rotation = find_captures(scene, with_noise(scene.frames(1), random));
      EXPECT_EQ(rotation.heights.size(), 1U);
      EXPECT_GE(rotation.captures.size(), 23U);
    }
  }
}

TEST(FitRotationAxis, ReturnsExactLeverArmFromLampsAtSeveralHeights) {
  RotationScene scene = tilted_scene();
  scene.map =
      make_lamp_map({{-0.5, -0.35, 1.6}, {0.5, 0.2, 1.4}, {-0.4, 0.3, 1.8}, {0.1, -0.4, 1.5}});
  const RotationFit exact = fit_rotation_axis(find_captures(scene, scene.frames()), scene.camera);
  ASSERT_TRUE(exact.converged && exact.center.lever_arm_m);
  EXPECT_LT(angle_between(exact.center.zenith_in_camera, scene.truth().zenith_in_camera),
            rad_from_deg(1e-6));
  EXPECT_THAT(*exact.center.lever_arm_m, IsNear(scene.lever_arm_m, 1e-7));
}

/// With a lever arm and a single height, fixes are those of the axis at that height.
TEST(FitRotationAxis, CalibrationFromOneHeightHasNoLeverArmAndYieldsFixesAtAxis) {
  const RotationScene scene = tilted_scene();
  const RotationFit found = fit_rotation_axis(find_captures(scene, scene.frames()), scene.camera);
  ASSERT_TRUE(found.converged);
  EXPECT_FALSE(found.center.lever_arm_m);
  Calibration calibration;
  calibration.camera = scene.camera;
  calibration.rotation_center = found.center;
  const Positioner positioner(scene.map, calibration);
  for (const Frame& frame : scene.frames()) {
    const Fix fix = positioner.compute_position_fix(frame.detections);
    ASSERT_TRUE(fix.has_succeeded());
    const Eigen::Vector2d place_m = fix.state.pose.position_m.head<2>();
    EXPECT_THAT(place_m, IsNear(scene.axis_m, 0.1 * scene.lever_arm_m.norm()));
  }
}

}  // namespace
}  // namespace vlp
