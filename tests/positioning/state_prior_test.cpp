// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <limits>

#include "geometry/symmetric.h"
#include "positioning/positioner.h"
#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using StateVector = Eigen::Matrix<double, kBodyStates, 1>;

/// Robot that drives, turns and is tilted, with a prior that has correlations of all states.
class CorrelatedPrior : public testing::Test {
 protected:
  BodyRig rig{synthetic_lamps(),
              rolling_calibration(),
              {{{0.1, -0.05, 0}, 0.4}, {{0.8, -0.6}, 0.5, {0.06, -0.08}}},
              CameraMount{{0.2, -0.1, 0.3}, 0.5}};
  StatePrior prior{rig.body, make_covariance()};

  static BodyCovariance make_covariance() {
    const double m = 0.02, rad = 0.01, m_per_s = 0.1, rad_per_s = 0.1;
    StateVector sd;
    sd << m, m, m, rad, m_per_s, m_per_s, rad_per_s, rad, rad;
    BodyCovariance correlation = BodyCovariance::Constant(0.3);
    correlation.diagonal().setOnes();
    correlation(0, 1) = correlation(1, 0) = 0.8;
    return sd.asDiagonal() * correlation * sd.asDiagonal();
  }
  Fix locate(const std::vector<Detection>& detections, const StatePrior& given) const {
    Sensors sensors;
    sensors.prior = given;
    return rig.positioner().compute_position_fix(detections, sensors);
  }
  static void add(const StateVector& error, BodyState& state) {
    auto& [pose, motion] = state;
    pose.position_m += error.head<3>();
    pose.yaw_rad += error[kBodyYaw];
    motion.velocity_m_per_s += error.segment<2>(kBodyVelocity);
    motion.yaw_rate_rad_per_s += error[kBodyYawRate];
    motion.inclination.roll_rad += error[kBodyRoll];
    motion.inclination.pitch_rad += error[kBodyPitch];
  }
};

TEST_F(CorrelatedPrior, FixCovarianceIsInverseOfSumOfInformation) {
  rig.body.motion = prior.mean.motion = {{0, 0}, 0, {0.06, -0.08}};
  for (const std::size_t lamps : {1U, 2U, 5U}) {
    auto detections = seen_from(rig, 0.1);
    ASSERT_GE(detections.size(), lamps);
    detections.resize(lamps);
    const Fix fix = locate(detections, prior);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.body.pose.position_m, 1e-7));
    BodyCovariance information = prior.covariance.inverse();
    for (const Detection& detection : detections) {
      const auto& jacobian = rig.positioner().project_lamp(detection.lamp, rig.body).jacobian;
      information += jacobian.transpose() * jacobian / (0.1 * 0.1);
    }
    const BodyCovariance expected = information.inverse();
    const StateVector sd = expected.diagonal().cwiseSqrt();
    EXPECT_THAT(sd.cwiseInverse().asDiagonal() * (fix.noise_covariance - expected) *
                    sd.cwiseInverse().asDiagonal(),
                IsNear(BodyCovariance(BodyCovariance::Zero()), lamps == 1 ? 0.02 : 1e-4))
        << lamps;
  }
}

TEST_F(CorrelatedPrior, FixErrorsMatchReportedCovariance) {
  auto exact = seen_from(rig, 0.1);
  exact.resize(2);
  const BodyCovariance root = prior.covariance.llt().matrixL();
  Random random(4);
  double sum = 0;
  constexpr int draws = 1000;
  for (int i = 0; i < draws; ++i) {
    StateVector noise, error;
    for (double& one : noise) one = random.normal();
    StatePrior drawn = prior;
    add(root * noise, drawn.mean);
    const Fix fix = locate(with_noise(exact, random), drawn);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    error << fix.state.pose.position_m - rig.body.pose.position_m,
        fix.state.pose.yaw_rad - rig.body.pose.yaw_rad,
        fix.state.motion.velocity_m_per_s - rig.body.motion.velocity_m_per_s,
        fix.state.motion.yaw_rate_rad_per_s - rig.body.motion.yaw_rate_rad_per_s,
        fix.state.motion.inclination.roll_rad - rig.body.motion.inclination.roll_rad,
        fix.state.motion.inclination.pitch_rad - rig.body.motion.inclination.pitch_rad;
    const BodyCovariance information = fix.noise_covariance.inverse();
    sum += error.dot(information * error) / kBodyStates;
  }
  EXPECT_NEAR(sum / draws, 1, 0.06);
}

TEST_F(CorrelatedPrior, DiagonalPriorEqualsSensorReadingsWithSds) {
  const auto detections = seen_from(rig, 0.1);
  Sensors sensors;
  sensors.inclination = Inclination{0.05, -0.07};
  sensors.inclination_sigma_rad = 0.02;
  sensors.motion = KnownMotion{{0.7, -0.5}, 0.4, 0.2, 0.3};
  sensors.height = KnownHeight{0.01, 0.02};
  StatePrior same{{{{0, 0, 0.01}, 0}, {{0.7, -0.5}, 0.4, {0.05, -0.07}}}, BodyCovariance::Zero()};
  const double unknown = std::numeric_limits<double>::infinity();
  same.covariance.diagonal() << unknown, unknown, 4e-4, unknown, 0.04, 0.04, 0.09, 4e-4, 4e-4;
  const Fix expected = rig.positioner().compute_position_fix(detections, sensors);
  const Fix fix = locate(detections, same);
  ASSERT_TRUE(fix.has_succeeded() && expected.has_succeeded());
  EXPECT_THAT(fix.state.pose.position_m, IsNear(expected.state.pose.position_m, 1e-12));
  EXPECT_THAT(fix.covariance, IsNear(expected.covariance, 1e-12));
}

TEST_F(CorrelatedPrior, LampsBelowCameraGiveSameFixUpsideDown) {
  const auto detections = seen_from(rig, 0.1);
  const Fix above = locate(detections, prior);
  ASSERT_TRUE(above.has_succeeded());
  StateVector signs;
  signs << 1, -1, -1, -1, 1, -1, -1, 1, -1;
  BodyRig below = rig;
  below.map.lamps_below_camera = true;
  for (Lamp& lamp : below.map.lamps) lamp.position_m.tail<2>() *= -1;
  below.mount = CameraMount{{0.2, 0.1, -0.3}, -0.5};
  Sensors sensors;
  sensors.prior = StatePrior{{{{0.1, 0.05, 0}, -0.4}, {{0.8, 0.6}, -0.5, {0.06, 0.08}}},
                             signs.asDiagonal() * prior.covariance * signs.asDiagonal()};
  const Fix fix = below.positioner().compute_position_fix(detections, sensors);
  ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
  EXPECT_THAT(Eigen::Vector3d(fix.state.pose.position_m.cwiseProduct(signs.head<3>())),
              IsNear(above.state.pose.position_m, 1e-9));
  EXPECT_THAT(signs.asDiagonal() * fix.covariance * signs.asDiagonal(),
              IsNear(above.covariance, 1e-12));
}

TEST_F(CorrelatedPrior, ContradictionAlongCorrelatedDirectionIsInconsistent) {
  auto detections = seen_from(rig, 0.01);
  // x and y are known to 1 m, their difference to 10 mm.
  prior.covariance.topLeftCorner<2, 2>() << 1, 1 - 5e-5, 1 - 5e-5, 1;
  prior.covariance.block<2, 7>(0, 2).setZero();
  prior.covariance.block<7, 2>(2, 0).setZero();
  prior.mean.pose.position_m += Eigen::Vector3d(0.5, 0.5, 0);
  EXPECT_EQ(locate(detections, prior).status, FixStatus::ok);
  prior.mean.pose.position_m += Eigen::Vector3d(0.06, -0.06, 0);
  EXPECT_EQ(locate(detections, prior).status, FixStatus::inconsistent);
}

TEST_F(CorrelatedPrior, IsRejectedIfInvalidOrCombinedWithOtherReadings) {
  const auto detections = seen_from(rig, 0.1);
  Sensors sensors;
  sensors.prior = prior;
  sensors.height = KnownHeight{0, 0.1};
  EXPECT_EQ(rig.positioner().compute_position_fix(detections, sensors).status,
            FixStatus::not_finite);
  StatePrior indefinite = prior;
  indefinite.covariance(0, 1) = indefinite.covariance(1, 0) = 1;
  EXPECT_EQ(locate(detections, indefinite).status, FixStatus::not_finite);
  StatePrior unknown_tilt = prior;
  unknown_tilt.covariance(kBodyRoll, kBodyRoll) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(locate(detections, unknown_tilt).status, FixStatus::not_finite);
  StatePrior no_yaw = prior;
  no_yaw.covariance(kBodyYaw, kBodyYaw) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(locate({detections.front()}, no_yaw).status, FixStatus::too_few_lamps);
}

}  // namespace
}  // namespace vlp
