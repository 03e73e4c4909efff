// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fixes whose residuals or priors contradict the assumptions: the covariance covers the errors, or
/// the status names the contradiction.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "support/body_rig.h"

namespace vlp {
namespace {

/// Sums of the squared errors of (X, Y, Z, yaw) of fixes, divided by their expectation.
class NormalizedErrors {
 public:
  void add(const Fix& fix, const Pose& truth) {
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    Eigen::Vector4d error;
    error << fix.state.pose.position_m - truth.position_m,
        wrap_angle_rad(fix.state.pose.yaw_rad - truth.yaw_rad);
    const Eigen::Matrix4d covariance = fix.pose_covariance();
    joint_ += error.dot(covariance.ldlt().solve(error)) / 4;
    each_ += error.array().square() / covariance.diagonal().array();
    ++count_;
  }
  int count() const { return count_; }
  double joint() const { return joint_ / count_; }
  Eigen::Array4d each() const { return each_ / count_; }

 private:
  double joint_ = 0;
  Eigen::Array4d each_ = Eigen::Array4d::Zero();
  int count_ = 0;
};

/// Fixes that assume a level camera at rest.
class PositionerAssumingLevelAtRest : public testing::TestWithParam<std::size_t> {
 protected:
  static constexpr double kSigma_px = 0.02;

  /// Returns the errors of fixes of a camera with this motion, in random directions.
  NormalizedErrors locate(double speed_m_per_s, double tilt_rad, double noise_px = kSigma_px) {
    NormalizedErrors errors;
    Random random(3);
    for (int i = 0; i < 100; ++i) {
      BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
      rig.map.lamps.resize(GetParam());
      rig.body.pose = {{random.uniform(-0.25, 0.25), random.uniform(-0.2, 0.2), 0},
                       random.uniform(-3.1, 3.1)};
      const double direction_rad = random.uniform(-3.1, 3.1);
      const Eigen::Vector2d direction(std::cos(direction_rad), std::sin(direction_rad));
      rig.body.motion.velocity_m_per_s = speed_m_per_s * direction;
      rig.body.motion.inclination = {tilt_rad * direction.x(), tilt_rad * direction.y()};
      auto detections = with_noise(seen_from(rig, noise_px), random);
      if (detections.size() < GetParam()) continue;
      for (Detection& detection : detections) detection.sigma_px = kSigma_px;
      errors.add(rig.positioner().compute_position_fix(detections), rig.body.pose);
    }
    EXPECT_GT(errors.count(), 50);
    return errors;
  }
};

TEST_P(PositionerAssumingLevelAtRest, CovarianceMatchesErrorsWithoutMotionOrTilt) {
  EXPECT_NEAR(locate(0, 0).joint(), 1, 0.2);
}

TEST_P(PositionerAssumingLevelAtRest, CovarianceCoversErrorsOfMovingCamera) {
  for (const double speed_m_per_s : {0.5, 2.0}) {
    const double joint = locate(speed_m_per_s, 0).joint();
    EXPECT_LT(joint, 1.2) << speed_m_per_s;
    EXPECT_GT(joint, 0.7) << speed_m_per_s;
  }
}

TEST_P(PositionerAssumingLevelAtRest, CovarianceCoversErrorsOfTiltedCamera) {
  for (const double tilt_deg : {0.2, 1.0, 5.0}) {
    const double joint = locate(0, rad_from_deg(tilt_deg)).joint();
    EXPECT_LT(joint, 1.2) << tilt_deg;
    EXPECT_GT(joint, 0.7) << tilt_deg;
  }
}

/// Frames of which the residuals do not contradict the noise keep the stated covariance.
TEST_P(PositionerAssumingLevelAtRest, CovarianceCoversErrorsWhenNoiseIsTenTimesTheGivenOne) {
  EXPECT_LT(locate(0, 0, 10 * kSigma_px).joint(), GetParam() == 4 ? 20 : 2);
}

INSTANTIATE_TEST_SUITE_P(Lamps, PositionerAssumingLevelAtRest, testing::Values(4, 8));

class PositionerPriors : public testing::Test {
 protected:
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.1, -0.05, 0}, 0.4}, {}}, {}};
};

TEST_F(PositionerPriors, StatusIsInconsistentForHeightBeyondFiveSds) {
  for (const std::size_t lamps : {2U, 4U, 8U}) {
    rig.map = synthetic_lamps();
    rig.map.lamps.resize(lamps);
    for (const auto& [z_m, status] : {std::pair(0.004, FixStatus::ok),
                                      {0.006, FixStatus::inconsistent},
                                      {50.0, FixStatus::inconsistent}}) {
      Sensors sensors;
      sensors.height = KnownHeight{z_m, 0.001};
      EXPECT_EQ(rig.positioner().compute_position_fix(seen_from(rig, 0.002), sensors).status,
                status)
          << lamps << " lamps, " << z_m << " m";
    }
  }
}

/// The errors of a map are those of its survey; errors of lens and zenith are unknown.
TEST_F(PositionerPriors, SurveySdKeepsLampsOfCorrectMapIfLensErrorsAreUnknown) {
  Random random(5);
  int fixes = 0;
  for (const std::size_t lamps : {4U, 5U, 8U}) {
    for (int i = 0; i < 100; ++i) {
      rig.map = synthetic_lamps();
      rig.map.lamps.resize(lamps);
      rig.body.pose.yaw_rad = random.uniform(-3, 3);
      const auto detections = with_noise(seen_from(rig, 0.05), random);
      constexpr double sd_m = 0.002;
      for (Lamp& lamp : rig.map.lamps) {
        lamp.sd_m = sd_m;
        lamp.position_m +=
            sd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      }
      const Fix fix = rig.positioner().compute_position_fix(detections);
      if (!fix.has_succeeded()) continue;
      ++fixes;
      EXPECT_EQ(fix.rejected_lamps, 0) << lamps << " lamps, " << i;
    }
  }
  EXPECT_GT(fixes, 250);
}

/// The joint covariance includes effects of second order, which exceed the noise of the pixels.
TEST_F(PositionerPriors, JointCovarianceOfOneLampMatchesErrorsUpToYawSdOf3Deg) {
  rig.map.lamps.resize(1);
  const auto exact = seen_from(rig, 0.05);
  const Positioner positioner = rig.positioner();
  Random random(21);
  for (const double yaw_sd_deg : {1.0, 2.0, 3.0}) {
    for (const double height_sd_m : {0.02, 0.05}) {
      const double yaw_sd_rad = rad_from_deg(yaw_sd_deg);
      NormalizedErrors errors;
      for (int i = 0; i < 10000; ++i) {
        Sensors sensors;
        sensors.height_and_yaw =
            HeightAndYaw{height_sd_m * random.normal(), 0.4 + yaw_sd_rad * random.normal(),
                         height_sd_m, yaw_sd_rad};
        errors.add(positioner.compute_position_fix(with_noise(exact, random), sensors),
                   rig.body.pose);
      }
      EXPECT_NEAR(errors.joint(), 1, 0.05) << yaw_sd_deg << " deg, " << height_sd_m << " m";
      EXPECT_LT((errors.each() - 1).abs().maxCoeff(), 0.05);
    }
  }
}

/// Fixes of three lamps with free roll and pitch.
TEST(PositionerThreeLamps, FixesWithUnknownTiltAreWithinSixSds) {
  int fixes = 0, ambiguous = 0, beyond_six_sds = 0;
  Random random(7);
  Sensors sensors;
  sensors.inclination_sigma_rad = 1.6;
  for (int i = 0; i < 3000; ++i) {
    BodyRig rig{{}, rolling_calibration(), {}, {}};
    rig.body.pose = {{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0},
                     random.uniform(-3.1, 3.1)};
    rig.body.motion.inclination = {random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8)};
    rig.map = draw_lamps_in_view(rig, 3, i % 2 == 0, 0.2, random);
    const auto exact = seen_from(rig, 0.05);
    if (exact.size() < 3) continue;
    const Fix fix = rig.positioner().compute_position_fix(with_noise(exact, random), sensors);
    ambiguous += fix.status == FixStatus::ambiguous;
    if (!fix.has_succeeded()) continue;
    ++fixes;
    const Eigen::Vector3d error = fix.state.pose.position_m - rig.body.pose.position_m;
    const Eigen::Array3d variances = fix.pose_covariance().diagonal().head<3>().array();
    beyond_six_sds += (error.array().square() > 36 * variances).any();
  }
  EXPECT_GT(fixes, 900);
  EXPECT_GT(ambiguous, 1500);
  EXPECT_EQ(beyond_six_sds, 0);
}

}  // namespace
}  // namespace vlp
