// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the covariance from calibration and lamp map with finite differences of fixes. Rejects
/// lamps that these errors do not explain.
#include "positioning/correlated_errors.h"

#include <gtest/gtest.h>

#include <tuple>

#include "positioning/positioner.h"
#include "positioning/stated_rig.h"
#include "rig/calibration_error.h"
#include "support/matchers.h"

namespace vlp {
namespace {

class CommonErrorsTest : public testing::Test {
 protected:
  StatedRig rig;

  /// States of a fix; without a body estimate only X, Y, Z and yaw, and zeros.
  using States = Eigen::Vector<double, kBodyStates>;
  static States to_states(const Fix& fix) {
    States states = States::Zero();
    states.head<4>() << fix.estimate.pose.position_m, fix.estimate.pose.yaw_rad;
    if (const auto& body = fix.body) {
      states.tail<5>() << body->velocity_m_per_s, body->yaw_rate_rad_per_s,
          body->inclination.roll_rad, body->inclination.pitch_rad;
    }
    return states;
  }

  void expect_common(const Fix& fix, const Eigen::MatrixXd& by_parameters,
                     const MatrixX& covariance) const {
    const Eigen::MatrixXd expected = by_parameters * covariance * by_parameters.transpose();
    const Eigen::Matrix4d of_pose = expected.topLeftCorner<4, 4>();
    EXPECT_THAT(fix.estimate.covariance - fix.noise_covariance,
                IsNear(of_pose, 1e-4 * of_pose.cwiseAbs().maxCoeff()));
    if (!fix.body) return;
    EXPECT_EQ(fix.estimate.covariance, Matrix4(fix.body->covariance.topLeftCorner<4, 4>()));
    EXPECT_EQ(fix.noise_covariance, Matrix4(fix.body->noise_covariance.topLeftCorner<4, 4>()));
    // Each state in its standard deviation, which given states lack.
    const Eigen::VectorXd sd = expected.diagonal().cwiseSqrt();
    const Eigen::VectorXd inverse_sd =
        (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Ones(kBodyStates));
    const Eigen::MatrixXd off =
        fix.body->covariance - fix.body->noise_covariance - BodyCovariance(expected);
    EXPECT_THAT(inverse_sd.asDiagonal() * off * inverse_sd.asDiagonal(),
                IsNear(Eigen::MatrixXd::Zero(kBodyStates, kBodyStates), 1e-3));
  }
};

/// Computes G by differences of fixes, independently of the formula.
class CommonErrorsOfFix : public CommonErrorsTest,
                          public testing::WithParamInterface<std::tuple<RotationModel, Sensors>> {};

TEST_P(CommonErrorsOfFix, MatchesFiniteDifferencesOfFix) {
  const Sensors& known = std::get<Sensors>(GetParam());
  rig.calibration.rotation_center->model = std::get<RotationModel>(GetParam());
  rig.adjust(1);
  rig.calibration.camera.row_time_s = 3e-5;
  rig.calibration.camera.readout = Readout::rows;
  const Adjustment adjustment = *rig.calibration.adjustment;
  // The yaw of a mount rotates the body relative to the camera.
  PositionerOptions options;
  if (known.motion) options.mount = CameraMount{{0, 0, 0}, 0.5};
  const auto detections = seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    LampMap map = rig.map;
    Calibration other = rig.calibration;
    if (parameter < 12) {
      other = with_lens_error(other, by * Eigen::VectorXd::Unit(12, parameter));
    } else if (parameter < 14) {
      other = with_zenith_error(other, by * Eigen::Vector2d::Unit(parameter - 12));
    } else if (parameter >= 16) {
      map.lamps[static_cast<std::size_t>(parameter - 16) / 3].position_m[(parameter - 16) % 3] +=
          by;
    }
    other.adjustment.reset();
    return to_states(Positioner(map, other, options).locate(detections, known));
  };
  Eigen::MatrixXd by_parameters(kBodyStates, 40);
  for (Eigen::Index i = 0; i < 40; ++i) {
    const double step = i < 4 ? 1e-3 : 1e-6;
    by_parameters.col(i) = (fix_with(i, step) - fix_with(i, -step)) / (2 * step);
  }
  const Fix fix = Positioner(rig.map, rig.calibration, options).locate(detections, known);
  ASSERT_TRUE(fix.ok());
  ASSERT_EQ(fix.body.has_value(), known.motion || known.inclination_sigma_rad > 0);
  expect_common(fix, by_parameters, adjustment.covariance);
  rig.calibration.adjustment.reset();
  const Fix noise = Positioner(rig.map, rig.calibration, options).locate(detections, known);
  EXPECT_EQ(noise.estimate.covariance, noise.noise_covariance);
  EXPECT_THAT(fix.noise_covariance, IsNear(noise.noise_covariance, 1e-15));
}

Sensors sensors(double inclination_sigma_rad, const std::optional<KnownMotion>& motion) {
  Sensors sensors;
  sensors.inclination_sigma_rad = inclination_sigma_rad;
  sensors.motion = motion;
  return sensors;
}

std::string name_of_body(const testing::TestParamInfo<CommonErrorsOfFix::ParamType>& body) {
  const Sensors& known = std::get<Sensors>(body.param);
  std::string name = known.motion ? "Driving" : "Standing";
  if (known.inclination_sigma_rad > 0) name += "AndLeaning";
  const bool shifted = std::get<RotationModel>(body.param) == RotationModel::shift;
  return name + (shifted ? "Shifted" : "Tilted");
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, CommonErrorsOfFix,
    testing::Combine(testing::Values(RotationModel::tilt, RotationModel::shift),
                     testing::Values(sensors(0, {}), sensors(0, KnownMotion::up_to(1, 1)),
                                     sensors(0.1, {}), sensors(0.1, KnownMotion::up_to(1, 1)))),
    name_of_body);

/// A calibration as by vlp-intrinsics: no other part depends on the lens.
TEST_F(CommonErrorsTest, MatchesFiniteDifferencesIfOnlyLensIsUncertain) {
  rig.calibrate_in_a_row();
  rig.calibration.rotation_center.reset();
  rig.calibration.dispersion.reset();
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m.reset();
  const MatrixX covariance = *rig.calibration.intrinsics_report->covariance;
  const auto detections = seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    const Calibration other =
        with_lens_error(rig.calibration, by * Eigen::VectorXd::Unit(12, parameter));
    return to_states(Positioner(rig.map, other).locate(detections));
  };
  Eigen::MatrixXd by_parameters(kBodyStates, 12);
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double step = i < 4 ? 1e-3 : 1e-6;
    by_parameters.col(i) = (fix_with(i, step) - fix_with(i, -step)) / (2 * step);
  }
  const Fix fix = Positioner(rig.map, rig.calibration).locate(detections);
  ASSERT_TRUE(fix.ok());
  EXPECT_GT(fix.estimate.covariance(0, 0), 2 * fix.noise_covariance(0, 0));
  expect_common(fix, by_parameters, covariance);
}

/// A part without derivatives by the lens hides the errors of the lens.
TEST_F(CommonErrorsTest, StatedReportsLensOnlyWithDerivatives) {
  const auto stated = [&](Correction correction) {
    return CommonErrors(rig.map.lamps, rig.calibration, correction).stated(CommonErrorSource::lens);
  };
  rig.calibrate_in_a_row();
  for (const Correction correction :
       {Correction::none, Correction::rotation, Correction::dispersion, Correction::all}) {
    EXPECT_TRUE(stated(correction));
  }
  rig.calibration.rotation_center->by_intrinsics.reset();
  EXPECT_FALSE(stated(Correction::rotation) || stated(Correction::all));
  EXPECT_TRUE(stated(Correction::dispersion));
  rig.calibration.dispersion->by_intrinsics.reset();
  EXPECT_FALSE(stated(Correction::dispersion));
  EXPECT_TRUE(stated(Correction::none));
}

TEST_F(CommonErrorsTest, PropagatesStandardDeviationOfSurvey) {
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  const Fix fix = Positioner(rig.map, rig.calibration).locate(seen_from(rig, 0.1));
  ASSERT_TRUE(fix.ok());
  const Matrix4 common = fix.estimate.covariance - fix.noise_covariance;
  // Eight lamps of 2 mm around the camera: slightly more than 2 / sqrt(8).
  EXPECT_NEAR(std::sqrt(common(0, 0)), 0.00075, 0.00008);
}

/// Lamps of a dispersion have rows in the joint covariance; a derivative of 0 adds no error to it.
TEST_F(CommonErrorsTest, MatchesWithAndWithoutRowsOfLamps) {
  rig.calibrate_in_a_row();
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  rig.calibration.dispersion->by_lamps.clear();
  const auto detections = seen_from(rig, 0.1);
  const Fix without = Positioner(rig.map, rig.calibration).locate(detections);
  const CommonErrors small(rig.map.lamps, rig.calibration, Correction::all);
  for (const Lamp& lamp : rig.map.lamps) {
    rig.calibration.dispersion->by_lamps.push_back(
        {lamp.id, lamp.position_m, *lamp.sd_m, Eigen::Matrix<double, 2, 3>::Zero()});
  }
  const CommonErrors large(rig.map.lamps, rig.calibration, Correction::all);
  EXPECT_EQ(small.joint().rows(), small.shared());
  EXPECT_EQ(large.joint().rows(), large.shared() + 3 * std::ssize(rig.map.lamps));
  const Fix with = Positioner(rig.map, rig.calibration).locate(detections);
  ASSERT_TRUE(with.ok() && without.ok());
  const double scale = with.estimate.covariance.norm();
  EXPECT_THAT(without.estimate.covariance, IsNear(with.estimate.covariance, 1e-12 * scale));
  EXPECT_TRUE(small.stated() && small.only(CommonErrorSource::lamps).stated());
}

TEST_F(CommonErrorsTest, RejectsLampThatNoErrorExplains) {
  rig.adjust(0.3);
  Random random(8);
  for (const double off_m : {0.01, 0.03}) {
    for (std::size_t moved = 0; moved < 8; ++moved) {
      SyntheticRig room = rig;
      room.map.lamps[moved].position_m.x() += off_m;
      const auto detections = with_noise(seen_from(room, 0.03), random);
      const Fix fix = Positioner(rig.map, rig.calibration).locate(detections);
      ASSERT_TRUE(fix.ok());
      EXPECT_EQ(fix.rejected_lamps, 1) << off_m << " m, lamp " << moved + 1;
      EXPECT_EQ(fix.rejected_ids[0], static_cast<int>(moved) + 1);
      EXPECT_THAT(fix.estimate.pose.position_m, IsNear(rig.camera.position_m, 0.001));
    }
  }
}

TEST_F(CommonErrorsTest, KeepsLampsThatSurveyErrorsExplain) {
  rig.adjust(3);
  Random random(9);
  for (std::size_t moved = 0; moved < 8; ++moved) {
    SyntheticRig room = rig;
    room.map.lamps[moved].position_m.y() += 0.004;
    const Fix fix =
        Positioner(rig.map, rig.calibration).locate(with_noise(seen_from(room, 0.03), random));
    ASSERT_TRUE(fix.ok());
    EXPECT_EQ(fix.rejected_lamps, 0);
  }
}

}  // namespace
}  // namespace vlp
