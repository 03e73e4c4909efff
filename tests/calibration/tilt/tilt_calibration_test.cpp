// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/tilt/tilt_calibration.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "calibration/tilt/drive.h"
#include "geometry/angles.h"
#include "geometry/similarity.h"
#include "support/joint_covariance.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the map with each lamp moved by up to `size_m` along each axis.
LampMap perturb_lamps(LampMap map, double size_m, Random& random) {
  for (Lamp& lamp : map.lamps) {
    lamp.position_m +=
        Eigen::Vector3d(random.uniform(-size_m, size_m), random.uniform(-size_m, size_m),
                        random.uniform(-size_m, size_m));
  }
  return map;
}

/// Returns the largest distance of a lamp from its true position, after the best fit of
/// translation, yaw and scale.
double compute_shape_error_m(const LampMap& found, const LampMap& truth) {
  const auto lamp = [](const LampMap& map, std::size_t i) { return map.lamps[i].position_m; };
  const Similarity fit =
      fit_similarity_transform(
          truth.lamps.size(),
          [&](std::size_t i) { return Eigen::Vector2d(lamp(found, i).head<2>()); },
          [&](std::size_t i) { return Eigen::Vector2d(lamp(truth, i).head<2>()); })
          .value();
  const double scale = fit.factor.norm();
  double lift_m = 0, worst_m = 0;
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    lift_m += (lamp(truth, i).z() - scale * lamp(found, i).z()) / double(truth.lamps.size());
  }
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    Eigen::Vector3d fitted;
    fitted << fit.offset + complex_product(fit.factor, lamp(found, i).head<2>()),
        scale * lamp(found, i).z() + lift_m;
    worst_m = std::max(worst_m, (fitted - lamp(truth, i)).norm());
  }
  return worst_m;
}

TEST(EstimateTiltFromLamps, ReturnsExactTiltWithoutNoise) {
  Random random(1);
  for (const double tilt_deg : {0.0, 0.5, 3.0, 6.0, 10.0}) {
    for (const bool stated : {true, false}) {
      const auto rig = make_tilted_rig(rad_from_deg(tilt_deg), random.uniform(-3, 3));
      auto frames = drive(rig, 8, random);
      for (Frame& frame : frames) {
        for (auto& detection : frame.detections) {
          if (!stated) detection.sigma_px.reset();
        }
      }
      const auto result = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
      ASSERT_EQ(result.undetermined, "") << tilt_deg;
      const auto& truth = *rig.calibration.rotation_center;
      EXPECT_LT(angle_between(result.center.zenith_in_camera, truth.zenith_in_camera), 1e-10);
      EXPECT_THAT(result.center.center_px, IsNear(truth.center_px, 1e-7));
      EXPECT_EQ(result.center.model, RotationModel::tilt);
      EXPECT_EQ(result.captures, 8);
      EXPECT_EQ(result.detections_rejected, 0);
      EXPECT_LT(result.residual_px, 1e-8);
      if (tilt_deg == 0) {
        EXPECT_LT(result.residual_before_px, 1e-8);
      } else {
        EXPECT_GT(result.residual_before_px, 0.1);
      }
    }
  }
}

TEST(EstimateTiltFromLamps, ResidualsOfLevelCameraEqualNoiseBeforeAndAfter) {
  Random random(7);
  auto rig = make_tilted_rig(0, 0);
  rig.calibration.camera.lens_model = LensModel::pinhole;
  rig.calibration.camera.intrinsics.resize(4);
  auto frames = drive(rig, 40, random, 0.2);
  for (Frame& frame : frames) frame.detections = with_noise(frame.detections, random);
  const auto result = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_NEAR(result.residual_before_px, 0.2, 0.03);
  EXPECT_NEAR(result.residual_px, 0.2, 0.03);
}

TEST(EstimateTiltFromLamps, ReturnsExactTiltFromThreeLampsPerCapture) {
  Random random(2);
  const auto rig = make_tilted_rig(0.05, 1);
  auto frames = drive(rig, 10, random);
  for (Frame& frame : frames) frame.detections.resize(3);
  frames[4].detections.resize(2);
  const auto result = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_LT(angle_between(result.center.zenith_in_camera,
                          rig.calibration.rotation_center->zenith_in_camera),
            1e-8);
  EXPECT_EQ(result.captures_of_few_lamps, 1);
  EXPECT_EQ(result.captures, 9);
}

TEST(EstimateTiltFromLamps, RecoversExactTiltAndMapShapeWhenRefiningMap) {
  Random random(3);
  auto rig = make_tilted_rig(0.05, 2);
  const LampMap surveyed = rig.map;
  rig.map = perturb_lamps(surveyed, 0.005, random);
  const auto frames = drive(rig, 12, random);
  TiltCalibrationOptions options;
  options.refine_map = true;
  const auto result = estimate_tilt_from_lamps(frames, surveyed, rig.calibration.camera, options);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_LT(angle_between(result.center.zenith_in_camera,
                          rig.calibration.rotation_center->zenith_in_camera),
            1e-8);
  ASSERT_EQ(result.map.lamps.size(), 8);
  ASSERT_EQ(result.corrections.size(), 8);
  EXPECT_GT(compute_shape_error_m(surveyed, rig.map), 0.003);
  EXPECT_LT(compute_shape_error_m(result.map, rig.map), 1e-8);

  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero(), moved = mean_m;
  for (const Lamp& lamp : surveyed.lamps) mean_m += lamp.position_m / 8;
  double turned = 0, scaled = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3d p = surveyed.lamps[i].position_m - mean_m;
    const Eigen::Vector3d& d = result.corrections[i].correction_m;
    EXPECT_THAT(result.map.lamps[i].position_m, IsNear(surveyed.lamps[i].position_m + d, 1e-12));
    moved += d;
    turned += p.x() * d.y() - p.y() * d.x();
    scaled += p.dot(d);
  }
  EXPECT_LT(moved.norm(), 1e-12) << "the mean of the map is held";
  EXPECT_LT(std::abs(turned), 1e-12);
  EXPECT_LT(std::abs(scaled), 1e-12);
}

TEST(EstimateTiltFromLamps, KeepsPositionOfUndetectedLampWhenRefiningMap) {
  Random random(4);
  const auto rig = make_tilted_rig(0.03, 2);
  auto frames = drive(rig, 12, random);
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [](const Detection& seen) { return seen.lamp == 3; });
  }
  TiltCalibrationOptions options;
  options.refine_map = true;
  const auto result = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_EQ(result.corrections.size(), 7);
  ASSERT_EQ(result.map.lamps.size(), 8);
  EXPECT_EQ(result.map.lamps[2].position_m, rig.map.lamps[2].position_m);
}

TEST(EstimateTiltFromLamps, RejectsSwappedAndDisplacedDetections) {
  Random random(5);
  const auto rig = make_tilted_rig(0.08, -1);
  auto frames = with_noise(drive(rig, 40, random, 0.05), random);
  for (std::size_t i = 0; i < 40; i += 4) {
    auto& detections = frames[i].detections;
    if (i % 8 == 0) {
      std::swap(detections[0].lamp, detections[1].lamp);
    } else {
      detections[2].pixel += Eigen::Vector2d(random.uniform(2, 10), random.uniform(2, 10));
    }
  }
  const auto result = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_GE(result.detections_rejected, 15);
  EXPECT_LE(result.detections_rejected, 20);
  const Eigen::Vector2d error =
      result.center.center_px - rig.calibration.rotation_center->center_px;
  ASSERT_EQ(result.covariance.rows(), 2);
  EXPECT_LT(
      error.dot(center_covariance_px2(result.covariance, rig.calibration.camera).inverse() * error),
      20);
  EXPECT_NEAR(result.residual_px, 0.05, 0.03);
}

}  // namespace
}  // namespace vlp
