// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo: the scatter of the fixes equals the Cramer-Rao bound and the reported covariance.
/// 20,000 draws determine a standard deviation to 0.5 %, one sixth of the tolerance of 3 %, and a
/// fraction of 5 % to 0.15 %.
#include <gtest/gtest.h>

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
  const auto budget = compute_fix_budget(lamps_m, Lens(camera.lens_model, camera.intrinsics),
                                         rig.camera, {sigma_px, 0, 0, 0});
  return budget.value().noise;
}

/// Compares the scatter of fixes, with noise of pixels and of `draw(random)` of the sensors, with
/// the covariance of the fix of exact detections.
template <typename Draw>
void expect_consistent(const Positioner& positioner, const std::vector<Detection>& exact,
                       const Sensors& sensors, const Draw& draw) {
  const Fix reported = positioner.compute_position_fix(exact, sensors);
  ASSERT_TRUE(reported.has_succeeded());
  Scatter scatter(reported.state.pose, reported.pose_covariance());
  Random random(11);
  for (int i = 0; i < kDraws; ++i) {
    const Fix fix = positioner.compute_position_fix(with_noise(exact, random), draw(random));
    ASSERT_TRUE(fix.has_succeeded());
    scatter.add(fix.state.pose);
  }
  EXPECT_LT(scatter.excess().cwiseAbs().maxCoeff(), kScatterTolerance)
      << scatter.excess().transpose();
  EXPECT_LT(scatter.bias().cwiseAbs().maxCoeff(), 5) << scatter.bias().transpose();
  EXPECT_NEAR(scatter.share_beyond_95(), 0.05, kShareTolerance);
}

class FixCovariance : public testing::TestWithParam<std::size_t> {
 protected:
  SyntheticRig rig = make_rig(GetParam());

  void expect_scatter_of_pixels() const {
    expect_consistent(Positioner(rig.map, rig.calibration), seen_from(rig, 0.2), {},
                      [](Random&) { return Sensors(); });
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

TEST_P(FixCovariance, MatchesScatterOfLevelCamera) { expect_scatter_of_pixels(); }

TEST_P(FixCovariance, MatchesScatterWithTiltAndManyHeights) {
  for (std::size_t i = 0; i < rig.map.lamps.size(); ++i) {
    rig.map.lamps[i].position_m.z() += i % 2 ? 0.3 : -0.2;
  }
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 1);
  expect_scatter_of_pixels();
}

INSTANTIATE_TEST_SUITE_P(Lamps, FixCovariance, testing::Values(2, 3, 4, 8));

/// Lamps with different noise.
TEST(FixCovariance, MatchesScatterOfRobotPoseWithInclinationSensorNoise) {
  const SyntheticRig rig = make_rig(4);
  auto exact = seen_from(rig, 0.1);
  ASSERT_EQ(exact.size(), 4U);
  exact[1].sigma_px = 0.5;
  exact[3].sigma_px = 0.3;
  PositionerOptions options;
  options.mount = CameraMount{{0.3, -0.2, 0.2}, 0.8};
  const Sensors sensors{Inclination{0, 0}, 0.002, {}};
  expect_consistent(Positioner(rig.map, rig.calibration, options), exact, sensors,
                    [&](Random& random) {
                      Sensors read = sensors;
                      read.inclination->roll_rad += 0.002 * random.normal();
                      read.inclination->pitch_rad += 0.002 * random.normal();
                      return read;
                    });
}

/// One lamp with height, yaw, inclination and motion of given standard deviations.
TEST(FixCovariance, MatchesScatterForOneLampWithUncertainSensors) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.15, -0.1, 0.1}, 0.9}, {}}, {}};
  rig.map.lamps.resize(1);
  Sensors sensors;
  sensors.inclination = Inclination{0, 0};
  sensors.inclination_sigma_rad = 0.002;
  sensors.height_and_yaw = HeightAndYaw{0.1, 0.9, 0.005, rad_from_deg(1)};
  sensors.motion = KnownMotion{{0.8, -0.3}, 0.4, 0.2, 0.3};
  rig.body.motion = {sensors.motion->velocity_m_per_s, sensors.motion->yaw_rate_rad_per_s, {0, 0}};
  expect_consistent(rig.positioner(), seen_from(rig, 0.2), sensors, [&](Random& random) {
    Sensors read = sensors;
    for (double& speed_m_per_s : read.motion->velocity_m_per_s) {
      speed_m_per_s += 0.2 * random.normal();
    }
    read.motion->yaw_rate_rad_per_s += 0.3 * random.normal();
    read.height_and_yaw->z_m += 0.005 * random.normal();
    read.height_and_yaw->yaw_rad += rad_from_deg(1) * random.normal();
    read.inclination->roll_rad += 0.002 * random.normal();
    read.inclination->pitch_rad += 0.002 * random.normal();
    return read;
  });
}

}  // namespace
}  // namespace vlp
