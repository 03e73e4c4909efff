// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo: the scatter of the fixes equals the Cramer-Rao bound and the reported covariance.
/// 20,000 draws determine a standard deviation to 0.5 %, one sixth of the tolerance of 3 %, and a
/// fraction of 5 % to 0.15 %.
#include <gtest/gtest.h>

#include "positioning/closed_form.h"
#include "positioning/error_budget.h"
#include "positioning/positioner.h"
#include "support/body_rig.h"
#include "support/scatter.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr int kDraws = 20000;
constexpr double kScatterTolerance = 0.03;
constexpr double kShareTolerance = 0.0075;  // five standard deviations

SyntheticRig make_rig(std::size_t lamps) {
  SyntheticRig rig{
      synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.15, -0.1, 0.1}, 0.9}, {}};
  rig.map.lamps.resize(lamps);
  return rig;
}

Eigen::Matrix4d compute_limit(const SyntheticRig& rig, double sigma_px) {
  std::vector<Eigen::Vector3d> lamps_m;
  for (const Lamp& lamp : rig.map.lamps) lamps_m.push_back(lamp.position_m);
  const Camera& camera = rig.calibration.camera;
  const auto budget = compute_fix_error_budget(lamps_m, Lens(camera.lens_model, camera.intrinsics),
                                               rig.camera, {sigma_px, 0, 0, 0});
  return budget.value().noise;
}

void expect_efficient(const Scatter& scatter) {
  EXPECT_LT(scatter.excess().cwiseAbs().maxCoeff(), kScatterTolerance)
      << scatter.excess().transpose();
}

class FixCovariance : public testing::TestWithParam<std::size_t> {
 protected:
  SyntheticRig rig = make_rig(GetParam());
  Random random{11};

  void expect_consistent(double sigma_px, const Sensors& sensors = {}) {
    const Positioner positioner(rig.map, rig.calibration);
    const auto exact = seen_from(rig, sigma_px);
    const Fix reported = positioner.compute_position_fix(exact, sensors);
    ASSERT_TRUE(reported.has_succeeded());
    Scatter scatter(rig.camera, reported.pose_covariance());
    for (int i = 0; i < kDraws; ++i) {
      const Fix fix = positioner.compute_position_fix(with_noise(exact, random), sensors);
      ASSERT_TRUE(fix.has_succeeded());
      scatter.add(fix.state.pose);
    }
    expect_efficient(scatter);
    EXPECT_LT(scatter.bias().cwiseAbs().maxCoeff(), 5) << scatter.bias().transpose();
    EXPECT_NEAR(scatter.share_beyond_95(), 0.05, kShareTolerance);
  }
};

TEST_P(FixCovariance, EqualsCramerRaoBound) {
  const double sigma_px = 0.2;
  const Fix fix =
      Positioner(rig.map, rig.calibration).compute_position_fix(seen_from(rig, sigma_px));
  ASSERT_TRUE(fix.has_succeeded());
  const Eigen::Matrix4d limit = compute_limit(rig, sigma_px);
  EXPECT_LT((fix.pose_covariance() - limit).norm(), 1e-6 * limit.norm());
}

TEST_P(FixCovariance, MatchesScatterOfLevelCamera) { expect_consistent(0.2); }

TEST_P(FixCovariance, MatchesScatterWithTiltAndManyHeights) {
  for (std::size_t i = 0; i < rig.map.lamps.size(); ++i) {
    rig.map.lamps[i].position_m.z() += i % 2 ? 0.3 : -0.2;
  }
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 1);
  expect_consistent(0.2);
}

INSTANTIATE_TEST_SUITE_P(Lamps, FixCovariance, testing::Values(2, 3, 4, 8));

TEST(FixCovariance, MatchesScatterWhenLampsHaveDifferentNoise) {
  const SyntheticRig rig = make_rig(4);
  const Positioner positioner(rig.map, rig.calibration);
  auto exact = seen_from(rig, 0.1);
  ASSERT_EQ(exact.size(), 4);
  exact[1].sigma_px = 0.5;
  exact[3].sigma_px = 0.3;
  const Fix reported = positioner.compute_position_fix(exact);
  ASSERT_TRUE(reported.has_succeeded());
  Scatter scatter(rig.camera, reported.pose_covariance());
  Random random(12);
  for (int i = 0; i < kDraws; ++i) {
    scatter.add(positioner.compute_position_fix(with_noise(exact, random)).state.pose);
  }
  expect_efficient(scatter);
}

TEST(FixCovariance, MatchesScatterWithInclinationSensorNoise) {
  SyntheticRig rig = make_rig(4);
  rig.inclination = {0.03, -0.02};
  const Positioner positioner(rig.map, rig.calibration);
  const auto exact = seen_from(rig, 0.1);
  const double sigma_rad = 0.002;
  const Fix reported = positioner.compute_position_fix(exact, {rig.inclination, sigma_rad, {}});
  ASSERT_TRUE(reported.has_succeeded());
  Scatter scatter(rig.camera, reported.pose_covariance());
  Random random(13);
  for (int i = 0; i < kDraws; ++i) {
    const Inclination read{rig.inclination->roll_rad + sigma_rad * random.normal(),
                           rig.inclination->pitch_rad + sigma_rad * random.normal()};
    scatter.add(positioner.compute_position_fix(with_noise(exact, random), {read, sigma_rad, {}})
                    .state.pose);
  }
  expect_efficient(scatter);
  EXPECT_NEAR(scatter.share_beyond_95(), 0.05, kShareTolerance);
}

TEST(FixCovariance, MatchesScatterOfRobotPoseWithCameraMount) {
  const SyntheticRig rig = make_rig(3);
  PositionerOptions options;
  options.mount = CameraMount{{0.4, -0.3, 0.2}, 0.5};
  const Positioner positioner(rig.map, rig.calibration, options);
  const auto exact = seen_from(rig, 0.2);
  const Fix truth = positioner.compute_position_fix(exact);
  ASSERT_TRUE(truth.has_succeeded());
  Scatter scatter(truth.state.pose, truth.pose_covariance());
  Random random(14);
  for (int i = 0; i < kDraws; ++i) {
    scatter.add(positioner.compute_position_fix(with_noise(exact, random)).state.pose);
  }
  expect_efficient(scatter);
  EXPECT_NEAR(scatter.share_beyond_95(), 0.05, kShareTolerance);
}

TEST(FixCovariance, MatchesScatterWithInclinationNoiseAndMountArm) {
  const SyntheticRig rig = make_rig(4);
  PositionerOptions options;
  options.mount = CameraMount{{0.3, -0.2, 1.0}, 0.8};
  const Positioner positioner(rig.map, rig.calibration, options);
  const auto exact = seen_from(rig, 0.1);
  const double sigma_rad = 0.005;
  const Fix truth = positioner.compute_position_fix(exact, {Inclination{0, 0}, sigma_rad, {}});
  ASSERT_TRUE(truth.has_succeeded());
  Scatter scatter(truth.state.pose, truth.pose_covariance());
  Random random(17);
  for (int i = 0; i < kDraws; ++i) {
    const Inclination read{sigma_rad * random.normal(), sigma_rad * random.normal()};
    scatter.add(positioner.compute_position_fix(with_noise(exact, random), {read, sigma_rad, {}})
                    .state.pose);
  }
  expect_efficient(scatter);
}

TEST(FixCovariance, MatchesScatterForOneLampWithInclinationNoise) {
  const SyntheticRig rig = make_rig(1);
  const Positioner positioner(rig.map, rig.calibration);
  const double sigma_rad = 0.005;
  const HeightAndYaw known{rig.camera.position_m.z(), rig.camera.yaw_rad};
  const auto exact = seen_from(rig, 0.1);
  const Fix reported =
      positioner.compute_position_fix(exact, {Inclination{0, 0}, sigma_rad, known});
  ASSERT_TRUE(reported.has_succeeded());
  Eigen::Matrix4d covariance = reported.pose_covariance();
  covariance.bottomRightCorner<2, 2>().setIdentity();
  Scatter scatter(rig.camera, covariance);
  Random random(18);
  for (int i = 0; i < kDraws; ++i) {
    const Inclination read{sigma_rad * random.normal(), sigma_rad * random.normal()};
    scatter.add(positioner.compute_position_fix(with_noise(exact, random), {read, sigma_rad, known})
                    .state.pose);
  }
  EXPECT_LT(scatter.excess().head<2>().cwiseAbs().maxCoeff(), kScatterTolerance);
}

TEST(FixCovariance, MatchesScatterWithStereographicLens) {
  SyntheticRig rig = make_rig(4);
  rig.calibration.camera.lens_model = LensModel::stereographic;
  rig.calibration.camera.intrinsics = {300, 300, 400, 300};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.1, 1);
  const Positioner positioner(rig.map, rig.calibration);
  const auto exact = seen_from(rig, 0.1);
  const Fix reported = positioner.compute_position_fix(exact);
  ASSERT_TRUE(reported.has_succeeded());
  Scatter scatter(rig.camera, reported.pose_covariance());
  Random random(19);
  for (int i = 0; i < kDraws; ++i) {
    scatter.add(positioner.compute_position_fix(with_noise(exact, random)).state.pose);
  }
  expect_efficient(scatter);
}

TEST(FixCovariance, MatchesScatterForOneLampWithKnownHeightAndYaw) {
  const SyntheticRig rig = make_rig(1);
  const Positioner positioner(rig.map, rig.calibration);
  const Sensors known{{}, 0, HeightAndYaw{rig.camera.position_m.z(), rig.camera.yaw_rad}};
  const auto exact = seen_from(rig, 0.2);
  const Fix reported = positioner.compute_position_fix(exact, known);
  ASSERT_TRUE(reported.has_succeeded());
  Eigen::Matrix4d covariance = reported.pose_covariance();
  EXPECT_LT(covariance(2, 2), 1e-17);
  EXPECT_LT(covariance(3, 3), 1e-17);
  covariance.bottomRightCorner<2, 2>().setIdentity();  // height and yaw do not scatter
  Scatter scatter(rig.camera, covariance);
  Random random(15);
  for (int i = 0; i < kDraws; ++i) {
    scatter.add(positioner.compute_position_fix(with_noise(exact, random), known).state.pose);
  }
  EXPECT_LT(scatter.excess().head<2>().cwiseAbs().maxCoeff(), kScatterTolerance);
}

/// One lamp with height, yaw and inclination of given standard deviations, and the motion.
TEST(FixCovariance, MatchesScatterForOneLampWithUncertainSensors) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.15, -0.1, 0.1}, 0.9}, {}}, {}};
  rig.map.lamps.resize(1);
  const double sigma_rad = 0.002, sigma_px = 0.2;
  Sensors sensors;
  sensors.inclination_sigma_rad = sigma_rad;
  sensors.height_and_yaw = HeightAndYaw{0.1, 0.9, 0.005, rad_from_deg(1)};
  sensors.motion = KnownMotion{{0.8, -0.3}, 0.4, 0.2, 0.3};
  const Positioner positioner(rig.map, rig.calibration);
  rig.body.motion = {sensors.motion->velocity_m_per_s, sensors.motion->yaw_rate_rad_per_s, {0, 0}};
  sensors.inclination = Inclination{0, 0};
  const Fix reported = positioner.compute_position_fix(seen_from(rig, sigma_px), sensors);
  ASSERT_TRUE(reported.has_succeeded());
  EXPECT_LT((reported.state.pose.position_m - rig.body.pose.position_m).norm(), 1e-9);
  Scatter scatter(rig.body.pose, reported.pose_covariance());
  Random random(21);
  for (int i = 0; i < kDraws; ++i) {
    rig.body.motion = {{0.8 + 0.2 * random.normal(), -0.3 + 0.2 * random.normal()},
                       0.4 + 0.3 * random.normal(),
                       {0, 0}};
    sensors.height_and_yaw->z_m = 0.1 + 0.005 * random.normal();
    sensors.height_and_yaw->yaw_rad = 0.9 + rad_from_deg(1) * random.normal();
    sensors.inclination = Inclination{sigma_rad * random.normal(), sigma_rad * random.normal()};
    const Fix fix =
        positioner.compute_position_fix(with_noise(seen_from(rig, sigma_px), random), sensors);
    ASSERT_TRUE(fix.has_succeeded());
    scatter.add(fix.state.pose);
  }
  expect_efficient(scatter);
}

TEST(Positioner, ReturnsRowTimeUnknownForMovingCameraWithoutRowTime) {
  const SyntheticRig rig = make_rig(1);
  Sensors sensors;
  sensors.height_and_yaw = HeightAndYaw{0.1, 0.9};
  sensors.motion = KnownMotion{{0.8, 0}, 0, 0, 0};
  EXPECT_EQ(
      Positioner(rig.map, rig.calibration).compute_position_fix(seen_from(rig), sensors).status,
      FixStatus::row_time_unknown);
}

TEST(Positioner, ReturnsTruePositionOfRotatingRobotThatSeesOneLamp) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.15, -0.1, 0.1}, 0.9}, {}}, {}};
  rig.mount = CameraMount{{0.3, -0.2, 0.5}, 0.7};
  rig.body.motion = {{0.5, 0.2}, 1.5, {0, 0}};
  Sensors sensors;
  sensors.height_and_yaw = HeightAndYaw{0.6, 0.9 + 0.7};
  sensors.motion = KnownMotion{{0.5, 0.2}, 1.5, 0, 0};
  std::vector<Detection> seen = seen_from(rig, 0.1);
  ASSERT_FALSE(seen.empty());
  seen.resize(1);
  const Fix fix = rig.positioner().compute_position_fix(seen, sensors);
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_LT((fix.state.pose.position_m - rig.body.pose.position_m).norm(), 1e-9);
}

/// With a pinhole lens all pixels have equal weights, and the closed forms are the least-squares
/// fix.
TEST(FixCovariance, ScatterOfClosedFormPosesReachesCramerRaoBoundWithPinhole) {
  for (const std::size_t lamps : {2u, 3u}) {
    SyntheticRig rig = make_rig(lamps);
    rig.calibration.camera.lens_model = LensModel::pinhole;
    rig.calibration.camera.intrinsics = {520, 520, 400, 300};
    const double sigma_px = 0.2;
    Scatter scatter(rig.camera, compute_limit(rig, sigma_px));
    std::vector<Sighting> sightings;
    for (const Lamp& lamp : rig.map.lamps) {
      sightings.push_back({lamp.position_m, {0, 0}});
    }
    Random random(16);
    for (int i = 0; i < kDraws; ++i) {
      for (Sighting& sighting : sightings) {
        sighting.z = level_point_from_world(rig.camera, sighting.lamp_m).hnormalized() +
                     sigma_px / 520 * Eigen::Vector2d(random.normal(), random.normal());
      }
      scatter.add(lamps == 2 ? compute_two_lamp_poses(sightings[0], sightings[1]).poses[0]
                             : compute_pose_from_coplanar_lamps(sightings).value());
    }
    expect_efficient(scatter);
  }
}

}  // namespace
}  // namespace vlp
