// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo test: the reported covariance of the tilt matches its scatter. 1000 draws determine
/// a standard deviation to 2.3 %; the tolerance of 8 % is more than three times as large.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"
#include "geometry/angles.h"
#include "support/joint_covariance.h"

namespace vlp {
namespace {

constexpr int kDrives = 1000;
constexpr double kDriveTolerance = 0.08;

void expect_consistent(const std::vector<Frame>& exact, const SyntheticRig& rig,
                       const LampMap& surveyed, bool refine_map, bool stated) {
  Random random(21);
  TiltCalibrationOptions options;
  options.refine_map = refine_map;
  const auto reference =
      estimate_camera_tilt_from_lamps(exact, surveyed, rig.calibration.camera, options);
  ASSERT_EQ(reference.undetermined, "");
  ASSERT_EQ(reference.corrections.size(), refine_map ? 8 : 0);
  Matrix2 scatter = Matrix2::Zero(), reported = Matrix2::Zero();
  Eigen::ArrayXd lamp_scatter = Eigen::ArrayXd::Zero(24), lamp_reported = lamp_scatter;
  for (int i = 0; i < kDrives; ++i) {
    auto frames = with_noise(exact, random);
    for (Frame& frame : frames) {
      for (auto& detection : frame.detections) {
        if (!stated) detection.sigma_px.reset();
      }
    }
    const auto result =
        estimate_camera_tilt_from_lamps(frames, surveyed, rig.calibration.camera, options);
    ASSERT_EQ(result.undetermined, "");
    ASSERT_EQ(result.covariance.rows(), 2);
    ASSERT_EQ(result.corrections.size(), reference.corrections.size());
    const Eigen::Vector2d error = result.center.center_px - reference.center.center_px;
    scatter += error * error.transpose() / kDrives;
    reported += center_covariance_px2(result.covariance, rig.calibration.camera) / kDrives;
    for (std::size_t k = 0; k < result.corrections.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(3 * k);
      lamp_scatter.segment<3>(at) +=
          (result.corrections[k].correction_m - reference.corrections[k].correction_m)
              .array()
              .square() /
          kDrives;
      lamp_reported.segment<3>(at) += result.corrections[k].sd_m.array().square() / kDrives;
    }
  }
  const Eigen::Array2d ratio = (scatter.diagonal().array() / reported.diagonal().array()).sqrt();
  EXPECT_LT((ratio - 1).abs().maxCoeff(), kDriveTolerance) << ratio.transpose();
  const double correlation = scatter(0, 1) / std::sqrt(scatter(0, 0) * scatter(1, 1));
  EXPECT_NEAR(correlation, reported(0, 1) / std::sqrt(reported(0, 0) * reported(1, 1)), 0.1);
  if (!refine_map) return;
  const Eigen::ArrayXd lamp_ratio = (lamp_scatter / lamp_reported).sqrt();
  EXPECT_LT((lamp_ratio - 1).abs().maxCoeff(), kDriveTolerance + 0.02) << lamp_ratio.transpose();
}

TEST(EstimateCameraTiltFromLamps, ZenithCovarianceMatchesScatterWithGivenNoise) {
  Random random(22);
  const auto rig = make_tilted_rig(0.05, 1);
  expect_consistent(drive(rig, 12, random, 0.1), rig, rig.map, false, true);
}

TEST(EstimateCameraTiltFromLamps, ZenithCovarianceMatchesScatterForThreeLampsPerCapture) {
  Random random(23);
  const auto rig = make_tilted_rig(0.05, 1);
  auto exact = drive(rig, 30, random, 0.1);
  for (Frame& frame : exact) frame.detections.resize(3);
  expect_consistent(exact, rig, rig.map, false, true);
}

TEST(EstimateCameraTiltFromLamps, ZenithCovarianceMatchesScatterWithoutGivenNoise) {
  Random random(24);
  auto rig = make_tilted_rig(0.05, 1);
  rig.calibration.camera.lens_model = LensModel::pinhole;  // equal noise in the undistorted image
  rig.calibration.camera.intrinsics = {520, 520, 400, 300};
  expect_consistent(drive(rig, 12, random, 0.1), rig, rig.map, false, false);
}

TEST(EstimateCameraTiltFromLamps, ZenithCovarianceMatchesScatterWhenRefiningMap) {
  Random random(25);
  auto rig = make_tilted_rig(0.05, 1);
  const LampMap surveyed = rig.map;
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.x() += random.uniform(-0.002, 0.002);
  expect_consistent(drive(rig, 16, random, 0.1), rig, surveyed, true, true);
}

/// Drive under a map with errors of its sd_m.
struct LampErrors {
  const char* name;
  double map_sd_m;
  /// Largest difference of a yaw from a common heading.
  double yaw_rad;
  bool noise_is_stated;
  int captures;
};

class EstimateTiltFromLampsWithMapErrors : public testing::TestWithParam<LampErrors> {};

/// 300 maps of two axes determine a standard deviation to 4 %.
TEST_P(EstimateTiltFromLampsWithMapErrors, ZenithErrorsMatchReportedCovariance) {
  const LampErrors& errors = GetParam();
  constexpr int maps = 300;
  Random random(26);
  double squares = 0, worst_rad = 0, reported_rad2 = 0;
  for (int i = 0; i < maps; ++i) {
    auto rig = make_tilted_rig(0.05, 1);
    std::vector<Frame> frames;
    for (int k = 0; k < errors.captures; ++k) {
      rig.camera = {{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), 0},
                    0.4 + random.uniform(-errors.yaw_rad, errors.yaw_rad)};
      frames.push_back({std::to_string(k), with_noise(seen_from(rig, 0.1), random)});
      for (Detection& detection : frames.back().detections) {
        if (!errors.noise_is_stated) detection.sigma_px.reset();
      }
    }
    LampMap surveyed = rig.map;
    for (Lamp& lamp : surveyed.lamps) {
      lamp.sd_m = errors.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += errors.map_sd_m * random.normal();
    }
    const auto result = estimate_camera_tilt_from_lamps(frames, surveyed, rig.calibration.camera);
    ASSERT_EQ(result.undetermined, "");
    ASSERT_EQ(result.covariance.rows(), 2);
    const Eigen::Vector2d error =
        result.center.center_px - rig.calibration.rotation_center->center_px;
    const double focal_px = rig.calibration.camera.focal_px().x();
    for (int axis = 0; axis < 2; ++axis) {
      const double variance =
          center_covariance_px2(result.covariance, rig.calibration.camera)(axis, axis);
      squares += error[axis] * error[axis] / variance / (2 * maps);
      reported_rad2 += variance / (focal_px * focal_px) / (2 * maps);
    }
    worst_rad = std::max(worst_rad, error.norm() / focal_px);
  }
  std::printf("%s: e/sd %.2f, sd %.4f degrees, worst error %.3f\n", errors.name, std::sqrt(squares),
              deg_from_rad(std::sqrt(reported_rad2)), deg_from_rad(worst_rad));
  EXPECT_NEAR(std::sqrt(squares), 1, 0.15);
}

INSTANTIATE_TEST_SUITE_P(Drives, EstimateTiltFromLampsWithMapErrors,
                         testing::Values(LampErrors{"NoMapErrors", 0, 3, true, 60},
                                         LampErrors{"OneWay", 2e-3, rad_from_deg(10), true, 60},
                                         LampErrors{"OneWayNoiseNotStated", 2e-3, rad_from_deg(10),
                                                    false, 60},
                                         LampErrors{"AnyYaw", 2e-3, 3, true, 60},
                                         LampErrors{"AnyYawNoiseNotStated", 2e-3, 3, false, 60},
                                         LampErrors{"AnyYawFewCaptures", 2e-3, 3, true, 8}),
                         [](const auto& errors) { return errors.param.name; });

}  // namespace
}  // namespace vlp
