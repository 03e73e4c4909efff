// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_captures.h"

#include <gmock/gmock.h>

#include <cmath>

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "geometry/angles.h"
#include "support/matchers.h"

namespace vlp {
namespace {

void expect_axis(const RotationFit& found, const RotationScene& scene, double within_deg) {
  ASSERT_TRUE(found.converged);
  EXPECT_LT(
      deg_from_rad(angle_between(found.center.zenith_in_camera, scene.truth().zenith_in_camera)),
      within_deg);
}

TEST(DetectPivots, ReturnsTrueHeightsYawsAxesAndLeverArm) {
  const RotationScene scene = tilted_scene({0.012, -0.009}, {0, 0.3});
  const RotationCaptures rotation = detect_pivots(scene.frames(), scene.map, scene.camera);
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  ASSERT_EQ(rotation.captures.size(), 24U);
  ASSERT_EQ(rotation.heights.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(rotation.heights[i].z_m, scene.heights_m[i], 1e-3);
    EXPECT_THAT(rotation.heights[i].axis_m, IsNear(scene.axis_m, 1e-3));
    EXPECT_EQ(rotation.heights[i].captures, 12);
    EXPECT_GT(deg_from_rad(rotation.heights[i].arc_rad), 300);
  }
  EXPECT_EQ(rotation.captures[0].height, 0U);
  EXPECT_EQ(rotation.captures[23].height, 1U);
  EXPECT_NEAR(rotation.captures[0].yaw_rad, scene.first_rad, 1e-3);
  for (std::size_t i = 0; i < rotation.captures.size(); ++i) {
    const RotationCapture& capture = rotation.captures[i];
    ASSERT_EQ(capture.image, std::to_string(i) + ".png");
    const double height = i < 12 ? 0 : 1, k = static_cast<double>(i % 12);
    const double yaw_rad = scene.first_rad + height +
                           scene.arc_rad * (k + 0.3 * std::sin(5 * k + height)) / (12 - 0.7);
    EXPECT_NEAR(wrap_angle_rad(capture.yaw_rad - yaw_rad), 0, 1e-3) << capture.image;
  }
  EXPECT_THAT(rotation.lever_arm_m, IsNear(scene.lever_arm_m, 1e-4));
  EXPECT_TRUE(rotation.rejected_captures.empty());
}

/// One third of the captures with a large error of one lamp and the noise of a poor detector.
TEST(FitRotationAxis, RejectsDisplacedDetectionsInThirdOfCaptures) {
  const RotationScene scene = tilted_scene({0.012, -0.009}, {0, 0.3});
  Random random(5);
  auto frames = with_noise(scene.frames(0.05), random);
  std::vector<std::pair<std::string, int>> wrong;
  for (std::size_t i = 0; i < frames.size(); i += 3) {
    Detection& one = frames[i].detections[i % frames[i].detections.size()];
    one.pixel += Eigen::Vector2d(random.uniform(2, 60), random.uniform(-60, -2));
    wrong.emplace_back(frames[i].image, one.lamp);
  }
  const RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  EXPECT_TRUE(rotation.rejected_captures.empty());
  const RotationFit found = fit_rotation_axis(rotation, scene.camera);
  expect_axis(found, scene, 0.01);
  std::vector<std::pair<std::string, int>> named;
  for (const auto& outlier : found.outliers) {
    const RotationObservation& observation = rotation.observations[outlier.observation];
    named.emplace_back(rotation.captures[observation.capture].image,
                       rotation.lamps[observation.lamp].id);
  }
  EXPECT_THAT(named, testing::IsSupersetOf(wrong));
  EXPECT_LE(named.size(), wrong.size() + 1);
}

TEST(DetectPivots, RejectsCaptureWithMisidentifiedLamp) {
  RotationScene scene;
  scene.tilt_rad = rad_from_deg(1.5);
  scene.map = make_lamp_map({{-0.3, -0.35, 1.6}, {0.5, 0.2, 1.6}, {0.1, 0.4, 1.6}});
  auto frames = scene.frames();
  for (Frame& frame : frames) frame.detections.resize(2);
  frames[4].detections[1].lamp = 3;
  const RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  ASSERT_EQ(rotation.rejected_captures.size(), 1U);
  EXPECT_EQ(rotation.rejected_captures[0].image, "4.png");
  expect_axis(fit_rotation_axis(rotation, scene.camera), scene, 1e-6);
}

/// The fit uses the heights of the map, but not its horizontal positions.
TEST(FitRotationAxis, KeepsAxisDespiteHorizontalMapErrors) {
  RotationScene scene = tilted_scene({0.012, -0.009}, {0, 0.3});
  scene.arc_rad = 2.5;
  const auto frames = scene.frames();
  Random random(6);
  for (Lamp& lamp : scene.map.lamps) {
    lamp.position_m.head<2>() +=
        Eigen::Vector2d(random.uniform(-5e-3, 5e-3), random.uniform(-5e-3, 5e-3));
  }
  expect_axis(fit_axis(scene, frames), scene, 0.01);
}

}  // namespace
}  // namespace vlp
