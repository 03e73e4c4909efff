// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Limits of the axis fit, and conversions of rotation centers.
#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "support/matchers.h"

namespace vlp {
namespace {

Camera make_camera_with_unequal_focal_lengths() {
  Camera camera = synthetic_camera();
  camera.intrinsics[0] = 540;
  camera.intrinsics[1] = 500;
  return camera;
}

/// Returns a scene of few captures under four lamps.
RotationScene make_small_scene(const Eigen::Vector2d& lever_arm_m,
                               const std::vector<double>& heights_m, double step_m = 0) {
  RotationScene scene = tilted_scene(lever_arm_m, heights_m);
  scene.camera = make_camera_with_unequal_focal_lengths();
  scene.map = make_lamp_map(
      {{-0.5, -0.35, 1.6 + step_m}, {0.5, 0.2, 1.6}, {-0.4, 0.3, 1.6 + step_m}, {0.1, -0.4, 1.6}});
  scene.captures = 5;
  scene.arc_rad = 5;
  scene.only_in_image = false;
  return scene;
}

RotationCaptures find_rotation(const RotationScene& scene, const std::vector<Frame>& frames) {
  RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok) << describe_status(rotation.status);
  return rotation;
}

/// A displaced detection with a sigma_px of its own is an outlier. The residual is that of the
/// other detections.
TEST(FitRotationAxis, OutlierDistanceAndResidualAreInPixels) {
  RotationScene scene = make_small_scene({0, 0}, {0});
  scene.captures = 12;
  scene.tilt_rad = 0;
  auto frames = scene.frames(0.5);
  for (Frame& frame : frames) {
    for (std::size_t i = 0; i < 2; ++i) frame.detections[i].sigma_px = 0.25;
  }
  frames[7].detections[1].pixel += Eigen::Vector2d(3, -4);
  const RotationCaptures rotation = find_rotation(scene, frames);
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  ASSERT_EQ(rotation.observations.size(), 48U);
  EXPECT_EQ(rotation.median_sigma_px, 0.5);
  const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
  ASSERT_TRUE(fit.converged);
  ASSERT_EQ(fit.outliers.size(), 1U);
  EXPECT_EQ(fit.outliers[0].observation, 29U);
  EXPECT_NEAR(fit.outliers[0].distance_px, 5, 0.15);
  ASSERT_EQ(fit.used_observations.size(), 47U);
  EXPECT_EQ(fit.used_observations[28], 28U);
  EXPECT_EQ(fit.used_observations[29], 30U);
  EXPECT_LT(fit.residual_px, 1e-6);
}

/// Returns captures with the given sigma_px, and with errors of up to `size_px` on each axis, in a
/// pattern that is the same for all sizes.
RotationCaptures find_captures_with_error(const RotationScene& scene, double size_px,
                                          double sigma_px) {
  std::vector<Frame> frames = scene.frames(sigma_px);
  Random random(25);
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) {
      const double u = random.uniform(-1, 1), v = random.uniform(-1, 1);
      detection.pixel += size_px * Eigen::Vector2d(u, v);
    }
  }
  return find_rotation(scene, frames);
}

/// The limit is 0.007 focal lengths or four times the stated noise.
TEST(FitRotationAxis, FailsIfResidualExceedsLimit) {
  const RotationScene scene = make_small_scene({0, 0}, {0});
  const double residual_per_px = [&] {
    const auto rotation = find_captures_with_error(scene, 1, 2);
    return fit_rotation_axis(rotation, scene.camera).residual_px;
  }();
  ASSERT_GT(residual_per_px, 0.2);
  for (const double sigma_px : {0.9, 1.5}) {
    const double limit_px = sigma_px < 1 ? 0.007 * 540 : 4 * 1.5;
    for (const double factor : {0.96, 1.04}) {
      const auto rotation =
          find_captures_with_error(scene, factor * limit_px / residual_per_px, sigma_px);
      ASSERT_EQ(rotation.status, RotationStatus::ok);
      const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
      EXPECT_EQ(fit.converged, factor < 1) << sigma_px << " px, factor " << factor;
      if (fit.converged) {
        EXPECT_NEAR(fit.residual_px, factor * limit_px, 0.02 * limit_px);
        EXPECT_TRUE(fit.outliers.empty());
      }
    }
  }
}

/// The limit of its standard deviation is 0.5 % of the height of the first lamp above the camera.
TEST(FitRotationAxis, OmitsLeverArmWithTooLargeStandardDeviation) {
  const RotationScene scene = make_small_scene({0.01, -0.02}, {-0.4}, 0.2);
  const auto fit_with = [&](double size_px) {
    return fit_rotation_axis(find_captures_with_error(scene, size_px, kMinSigma_px), scene.camera);
  };
  constexpr double small_px = 0.01;
  const RotationFit small = fit_with(small_px);
  ASSERT_TRUE(small.converged && small.center.lever_arm_m);
  const double sd_m = std::sqrt(small.covariance->diagonal().tail<2>().maxCoeff());
  const double limit_px = small_px * 0.005 * 2.2 / sd_m;  // at the height 1.6 + 0.2 + 0.4 m
  for (const double factor : {0.9, 1.1}) {
    const RotationFit fit = fit_with(factor * limit_px);
    ASSERT_TRUE(fit.converged);
    EXPECT_EQ(fit.center.lever_arm_m.has_value(), factor < 1) << limit_px << " px";
    EXPECT_TRUE(fit.covariance);
  }
}

TEST(ComputeTilt, ReturnsAngleAndAzimuthOfZenith) {
  RotationCenter center{};
  center.zenith_in_camera = Eigen::Vector3d(0.03, 0.04, 0.05).normalized();
  EXPECT_NEAR(compute_tilt(center).angle_rad, M_PI / 4, 1e-12);
  EXPECT_NEAR(compute_tilt(center).azimuth_rad, std::atan(4. / 3), 1e-12);
  center.zenith_in_camera = Eigen::Vector3d(-0.2, 0, 0.98).normalized();
  EXPECT_NEAR(compute_tilt(center).azimuth_rad, M_PI, 1e-12);
  EXPECT_NEAR(compute_tilt(center).angle_rad, std::atan(0.2 / 0.98), 1e-12);
}

TEST(MakeRotationCenter, ScalesPointByFocalLengths) {
  const Camera camera = make_camera_with_unequal_focal_lengths();
  const RotationCenter center = make_rotation_center({0.3, -0.4}, RotationModel::shift, camera);
  EXPECT_EQ(center.model, RotationModel::shift);
  EXPECT_THAT(center.center_px, IsNear(Eigen::Vector2d(403 + 162, 296 - 200), 1e-9));
  EXPECT_THAT(center.zenith_in_camera,
              IsNear(Eigen::Vector3d(0.3, -0.4, 1) / std::sqrt(1.25), 1e-12));
  EXPECT_FALSE(center.lever_arm_m);
  EXPECT_THAT(ideal_pixel_from_point(camera, {-0.1, 0.2}),
              IsNear(Eigen::Vector2d(403 - 54, 296 + 100), 1e-9));
}

}  // namespace
}  // namespace vlp
