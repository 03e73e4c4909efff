// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/circle_center.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calibration/rotation/spot.h"
#include "geometry/angles.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns a scene with a pinhole camera, so that formulas are in pixels.
RotationScene pinhole_scene() {
  RotationScene scene;
  scene.camera.lens_model = LensModel::pinhole;
  scene.camera.intrinsics = {520, 522, 403, 296};
  return scene;
}

RotationCaptures find_captures(const RotationScene& scene) {
  RotationCaptures rotation = detect_pivots(scene.frames(), scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok);
  return rotation;
}

CircleCenters find_centers(const RotationCaptures& rotation, const Camera& camera) {
  return fit_circle_centers(rotation, camera, fit_rotation_axis(rotation, camera));
}

/// Returns the image point zeta - e/H of the axis of a level camera.
Eigen::Vector2d center_of_level_camera(const RotationScene& scene) {
  const auto& f = scene.camera.intrinsics;
  const Eigen::Vector2d z = -scene.lever_arm_m / (1.6 - scene.heights_m[0]);
  return {f[2] + f[0] * z.x(), f[3] + f[1] * z.y()};
}

TEST(FitCircleCenters, ReturnsAxisPixelWhenCameraIsLevel) {
  RotationScene scene;
  scene.lever_arm_m = {0.05, -0.02};
  const CircleCenters found = find_centers(find_captures(scene), scene.camera);
  ASSERT_TRUE(found.mean.converged);
  EXPECT_THAT(found.mean.center.center_px, IsNear(center_of_level_camera(scene), 1e-6));
  EXPECT_LT(found.spread_px, 1e-6);
  EXPECT_LT(found.mean.residual_px, 1e-6);
  EXPECT_EQ(found.circles.size(), scene.map.lamps.size());
  EXPECT_EQ(found.mean.center.model, RotationModel::shift);
}

/// The rays to a lamp form a cone about the axis. A tilted camera maps it to an ellipse with its
/// center at f sin t cos t / (cos^2 t - sin^2 phi) from the principal point. A circle through many
/// equally spaced points of the ellipse has the same center, up to second order in t.
TEST(FitCircleCenters, CircleCentersMatchEllipseFormulaForTiltedCamera) {
  for (const double tilt_deg : {0.5, 1.0, 2.0}) {
    SCOPED_TRACE(tilt_deg);
    RotationScene scene = pinhole_scene();
    scene.tilt_rad = rad_from_deg(tilt_deg);
    scene.axis_m = {0, 0};
    scene.captures = 72;
    scene.arc_rad = 2 * M_PI * (72 - 0.7) / 72;
    scene.only_in_image = false;
    const RotationCaptures rotation = find_captures(scene);
    const CircleCenters found = find_centers(rotation, scene.camera);
    ASSERT_EQ(found.circles.size(), scene.map.lamps.size());
    const double t = scene.tilt_rad;
    for (const auto& [lamp, height, fit] : found.circles) {
      const double phi = std::atan(rotation.lamps[lamp].position_m.head<2>().norm() / 1.6);
      const double formula =
          std::sin(t) * std::cos(t) / (std::pow(std::cos(t), 2) - std::pow(std::sin(phi), 2));
      EXPECT_NEAR(fit.circle.center.norm() / formula, 1, 0.01) << deg_from_rad(phi);
      EXPECT_GT(fit.circle.center.norm(), 1.01 * std::tan(t));
    }
    EXPECT_GT(found.spread_px, 0.02 * 520 * std::tan(t));
  }
}

/// Returns frames of a camera at these yaws and one height, with noise of 0.3 px.
std::vector<Frame> frames_at(RotationScene scene, const std::vector<double>& yaws_rad,
                             double height_m, Random& random) {
  scene.captures = 1;
  scene.heights_m = {height_m};
  std::vector<Frame> frames;
  for (const double yaw_rad : yaws_rad) {
    scene.first_rad = yaw_rad;
    Frame frame = with_noise(scene.frames(0.3), random).front();
    frame.image = std::to_string(height_m) + "-" + std::to_string(frames.size());
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// Returns captures of a level camera at these yaws, with noise of 0.3 px.
RotationCaptures captures_at(const std::vector<double>& yaws_rad, bool noise_is_stated,
                             Random& random) {
  const RotationScene scene;
  std::vector<Frame> frames = frames_at(scene, yaws_rad, 0, random);
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) {
      if (!noise_is_stated) detection.sigma_px.reset();
    }
  }
  RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok);
  return rotation;
}

/// With captures at two opposite yaws, only noise makes a triangle of the positions of a lamp.
TEST(FitCircleCenters, DoesNotConvergeAtTwoOppositeYaws) {
  constexpr int draws = 8;
  Random random(31);
  for (const int count : {3, 6, 12, 40}) {
    for (const bool noise_is_stated : {true, false}) {
      for (int i = 0; i < draws; ++i) {
        const double yaw_rad = random.uniform(-M_PI, M_PI);
        std::vector<double> yaws_rad;
        for (int k = 0; k < count; ++k) yaws_rad.push_back(yaw_rad + k % 2 * M_PI);
        const RotationCaptures rotation = captures_at(yaws_rad, noise_is_stated, random);
        ASSERT_EQ(rotation.status, RotationStatus::ok);
        const CircleCenters found = find_centers(rotation, RotationScene().camera);
        EXPECT_FALSE(found.mean.converged) << count << " captures, draw " << i;
        EXPECT_GT(found.undetermined, 0);
      }
    }
  }
}

TEST(FitCircleCenters, ConvergesWhenThirdYawJoinsOppositeYaws) {
  constexpr int draws = 8;
  Random random(32);
  for (int i = 0; i < draws; ++i) {
    const double yaw_rad = random.uniform(-M_PI, M_PI);
    const RotationCaptures rotation = captures_at(
        {yaw_rad, yaw_rad + M_PI, yaw_rad, yaw_rad + M_PI, yaw_rad + M_PI / 2, yaw_rad + M_PI / 2},
        true, random);
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const CircleCenters found = find_centers(rotation, RotationScene().camera);
    ASSERT_TRUE(found.mean.converged);
    ASSERT_TRUE(found.mean.covariance);
    EXPECT_THAT(found.mean.center.center_px, IsNear(center_of_level_camera(RotationScene()), 2));
  }
}

}  // namespace
}  // namespace vlp
