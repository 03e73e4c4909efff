// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the covariance from calibration and lamp map with finite differences of fixes. Rejects
/// lamps that these errors do not explain.
#include "positioning/correlated_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "positioning/positioner.h"
#include "positioning/stated_rig.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

class CommonErrorsTest : public testing::Test {
 protected:
  StatedRig rig;

  using States = Eigen::Vector<double, kBodyStates>;
  static States to_states(const Fix& fix) {
    const auto& [pose, motion] = fix.state;
    States states;
    states << pose.position_m, pose.yaw_rad, motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
        motion.inclination.roll_rad, motion.inclination.pitch_rad;
    return states;
  }

  void expect_common(const Fix& fix, const Eigen::MatrixXd& by_parameters,
                     const MatrixX& covariance) const {
    const Eigen::MatrixXd expected = by_parameters * covariance * by_parameters.transpose();
    // Each state in its standard deviation, which given states lack.
    const Eigen::VectorXd sd = expected.diagonal().cwiseSqrt();
    const Eigen::VectorXd inverse_sd =
        (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Ones(kBodyStates));
    const Eigen::MatrixXd off = fix.covariance - fix.noise_covariance - BodyCovariance(expected);
    EXPECT_THAT(inverse_sd.asDiagonal() * off * inverse_sd.asDiagonal(),
                IsNear(Eigen::MatrixXd::Zero(kBodyStates, kBodyStates), 1e-3));
  }
};

/// Computes G by differences of fixes, independently of the formula.
class CommonErrorsOfFix : public CommonErrorsTest,
                          public testing::WithParamInterface<std::tuple<RotationModel, Sensors>> {};

TEST_P(CommonErrorsOfFix, CommonCovarianceMatchesFiniteDifferencesOfFix) {
  const Sensors& known = std::get<Sensors>(GetParam());
  rig.calibration.rotation_center->model = std::get<RotationModel>(GetParam());
  rig.adjust(1);
  rig.calibration.camera.row_time_s = 3e-5;
  rig.calibration.camera.readout = Readout::rows;
  const MatrixX covariance = rig.calibration.covariance->matrix;
  // The mount displaces and rotates the camera relative to the base.
  PositionerOptions options;
  if (known.motion) options.mount = CameraMount{{0.3, -0.2, 0.15}, 0.5};
  const auto detections =
      known.inclination
          ? seen_from(
                BodyRig{
                    rig.map, rig.calibration, {rig.camera, {{0, 0}, 0, *known.inclination}}, {}},
                0.1)
          : seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    LampMap map = rig.map;
    Calibration other = rig.calibration;
    if (parameter < 12) {
      other = add_intrinsics_error(other, by * Eigen::VectorXd::Unit(12, parameter));
    } else if (parameter < 14) {
      other = add_zenith_error(other, by * Eigen::Vector2d::Unit(parameter - 12));
    } else if (parameter >= 16) {
      map.lamps[static_cast<std::size_t>(parameter - 16) / 3].position_m[(parameter - 16) % 3] +=
          by;
    }
    return to_states(Positioner(map, other, options).compute_position_fix(detections, known));
  };
  Eigen::MatrixXd by_parameters(kBodyStates, 40);
  for (Eigen::Index i = 0; i < 40; ++i) {
    const double step = i < 4 ? 1e-3 : 1e-6;
    by_parameters.col(i) = (fix_with(i, step) - fix_with(i, -step)) / (2 * step);
  }
  const Fix fix =
      Positioner(rig.map, rig.calibration, options).compute_position_fix(detections, known);
  ASSERT_TRUE(fix.has_succeeded());
  expect_common(fix, by_parameters, covariance);
  rig.calibration.adjustment.reset();
  rig.calibration.covariance.reset();
  const Fix noise =
      Positioner(rig.map, rig.calibration, options).compute_position_fix(detections, known);
  EXPECT_EQ(noise.covariance, noise.noise_covariance);
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
  if (known.inclination) name += "Inclined";
  const bool shifted = std::get<RotationModel>(body.param) == RotationModel::shift;
  return name + (shifted ? "Shifted" : "Tilted");
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, CommonErrorsOfFix,
    testing::Combine(testing::Values(RotationModel::tilt, RotationModel::shift),
                     testing::Values(sensors(0, {}),
                                     sensors(0, KnownMotion::make_motion_prior_from_limits(1, 1)),
                                     sensors(0.1, {}),
                                     sensors(0.1,
                                             KnownMotion::make_motion_prior_from_limits(1, 1)))),
    name_of_body);

Sensors sensors_with_exact_inclination() {
  Sensors sensors;
  sensors.inclination = Inclination{0.2, -0.1};
  return sensors;
}

INSTANTIATE_TEST_SUITE_P(ExactInclination, CommonErrorsOfFix,
                         testing::Combine(testing::Values(RotationModel::tilt),
                                          testing::Values(sensors_with_exact_inclination())),
                         name_of_body);

/// A calibration as by vlp-intrinsics: no other part depends on the lens.
TEST_F(CommonErrorsTest, FixCovarianceMatchesFiniteDifferencesWhenOnlyLensIsUncertain) {
  rig.calibrate_in_a_row();
  rig.calibration.rotation_center.reset();
  rig.calibration.dispersion.reset();
  rig.calibration.covariance.reset();
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m.reset();
  const MatrixX covariance = *rig.calibration.intrinsics_report->covariance;
  const auto detections = seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    const Calibration other =
        add_intrinsics_error(rig.calibration, by * Eigen::VectorXd::Unit(12, parameter));
    return to_states(Positioner(rig.map, other).compute_position_fix(detections));
  };
  Eigen::MatrixXd by_parameters(kBodyStates, 12);
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double step = i < 4 ? 1e-3 : 1e-6;
    by_parameters.col(i) = (fix_with(i, step) - fix_with(i, -step)) / (2 * step);
  }
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_GT(fix.pose_covariance()(0, 0), 2 * fix.noise_covariance(0, 0));
  expect_common(fix, by_parameters, covariance);
}

/// A step whose joint covariance lacks the lens hides the errors of the lens.
TEST_F(CommonErrorsTest, LensErrorsAreUnknownIfAppliedStepIsIndependentOfLens) {
  const auto stated = [&](Correction correction) {
    return CommonErrors(rig.map.lamps, rig.calibration, correction)
        .is_known_or_absent(CommonErrorSource::lens);
  };
  rig.calibrate_in_a_row();
  for (const Correction correction :
       {Correction::none, Correction::rotation, Correction::dispersion, Correction::all}) {
    EXPECT_TRUE(stated(correction));
  }
  rig.calibration.covariance = {{}, {"zenith_x", "zenith_y"}, Matrix2::Identity()};
  for (const Correction correction :
       {Correction::rotation, Correction::dispersion, Correction::all}) {
    EXPECT_FALSE(stated(correction));
  }
  EXPECT_TRUE(stated(Correction::none));
}

/// An offset whose own errors are unknown moves against the error of the zenith.
TEST_F(CommonErrorsTest, DispersionOffsetWithUnknownErrorsCompensatesZenith) {
  rig.calibrate_in_a_row();
  rig.calibration.covariance = remove_dispersion(rig.calibration).covariance;
  const CommonErrors errors(rig.map.lamps, rig.calibration, Correction::all);
  const MatrixX& joint = errors.joint_covariance();
  ASSERT_EQ(joint.rows(), 16);
  EXPECT_FALSE(errors.is_known_or_absent(CommonErrorSource::offset));
  EXPECT_TRUE(errors.is_known_or_absent(CommonErrorSource::zenith));
  EXPECT_GT(joint(12, 12), 0);
  EXPECT_EQ(joint.row(14), -joint.row(12));
  EXPECT_EQ(joint.col(15), -joint.col(13));
}

/// Lamps of the joint covariance without correlation have the same effect as those of the survey.
TEST_F(CommonErrorsTest, FixCovarianceIsUnchangedByUncorrelatedLampsOfJointCovariance) {
  rig.calibrate_in_a_row();
  rig.calibration = remove_dispersion(rig.calibration);
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  const auto detections = seen_from(rig, 0.1);
  const Fix without = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  const CommonErrors small(rig.map.lamps, rig.calibration, Correction::all);
  JointCovariance& joint = *rig.calibration.covariance;
  for (const Lamp& lamp : rig.map.lamps) {
    joint.lamps.push_back({lamp.id, lamp.position_m});
    append_parameters(joint, list_lamp_parameters(lamp.id), MatrixX::Zero(3, joint.matrix.rows()),
                      4e-6 * Eigen::Matrix3d::Identity());
  }
  const CommonErrors large(rig.map.lamps, rig.calibration, Correction::all);
  EXPECT_EQ(small.joint_covariance().rows(), small.num_shared_errors());
  EXPECT_EQ(large.joint_covariance().rows(),
            large.num_shared_errors() + 3 * std::ssize(rig.map.lamps));
  const Fix with = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  ASSERT_TRUE(with.has_succeeded() && without.has_succeeded());
  const double scale = with.pose_covariance().norm();
  EXPECT_THAT(without.pose_covariance(), IsNear(with.pose_covariance(), 1e-12 * scale));
  EXPECT_TRUE(small.has_known_errors() &&
              small.isolate_error_source(CommonErrorSource::lamps).has_known_errors());
}

/// The offset depends on a lamp of the adjustment, whose error is not in the survey.
TEST_F(CommonErrorsTest, DispersionOffsetIsCorrelatedWithAdjustedLamp) {
  rig.adjust(1);
  MatrixX jacobian = MatrixX::Zero(2, 40);
  jacobian.middleCols<3>(19) << 0.5, -0.1, 0.2, 0.1, 0.6, -0.3;
  JointCovariance& joint = *rig.calibration.covariance;
  append_parameters(joint, list_pair_names(kOffsetParameter), jacobian, Matrix2::Zero());
  rig.calibration.dispersion = {{0.4, -0.3}, 0.001, {0, 0}, 12};
  const CommonErrors errors(rig.map.lamps, rig.calibration, Correction::all);
  const MatrixX& found = errors.joint_covariance();
  ASSERT_EQ(found.rows(), 12 + 2 + 2 + 24);
  EXPECT_EQ((found.block<2, 2>(14, 14)), (joint.matrix.block<2, 2>(40, 40)));
  EXPECT_EQ((found.block<2, 3>(14, 19)), (joint.matrix.block<2, 3>(40, 19)));
  EXPECT_EQ((found.block<2, 14>(14, 0)), (joint.matrix.block<2, 14>(40, 0)));
  EXPECT_EQ(errors.num_lamps_moved_since_calibration(), 0);
  rig.map.lamps[1].position_m.x() += 1e-5;
  EXPECT_EQ(CommonErrors(rig.map.lamps, rig.calibration, Correction::all)
                .num_lamps_moved_since_calibration(),
            1);
}

TEST_F(CommonErrorsTest, PositionFixRejectsLampMovedFarBeyondItsSd) {
  rig.adjust(0.3);
  Random random(8);
  for (const double off_m : {0.01, 0.03}) {
    for (std::size_t moved = 0; moved < 8; ++moved) {
      SyntheticRig room = rig;
      room.map.lamps[moved].position_m.x() += off_m;
      const auto detections = with_noise(seen_from(room, 0.03), random);
      const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
      ASSERT_TRUE(fix.has_succeeded());
      EXPECT_EQ(fix.rejected_lamps, 1) << off_m << " m, lamp " << moved + 1;
      EXPECT_EQ(fix.rejected_ids[0], static_cast<int>(moved) + 1);
      EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.camera.position_m, 0.001));
    }
  }
}

TEST_F(CommonErrorsTest, PositionFixKeepsLampMovedByAboutItsSd) {
  rig.adjust(3);
  Random random(9);
  for (std::size_t moved = 0; moved < 8; ++moved) {
    SyntheticRig room = rig;
    room.map.lamps[moved].position_m.y() += 0.004;
    const Fix fix = Positioner(rig.map, rig.calibration)
                        .compute_position_fix(with_noise(seen_from(room, 0.03), random));
    ASSERT_TRUE(fix.has_succeeded());
    EXPECT_EQ(fix.rejected_lamps, 0);
  }
}

/// The detector's noise alone would reject the lamp. Errors of the map that are known to be of that
/// size keep it.
TEST_F(CommonErrorsTest, FixOfMovingCameraKeepsLampMovedByAboutItsSd) {
  rig.calibration.camera.row_time_s = 30e-6;
  rig.calibration.camera.readout = Readout::rows;
  const Calibration with_unknown_errors = rig.calibration;
  rig.adjust(3);
  SyntheticRig room = rig;
  room.map.lamps[2].position_m.y() += 0.008;
  const auto detections = seen_from(room, 0.03);
  ASSERT_EQ(detections.size(), 8);
  Sensors driving;
  driving.motion = KnownMotion::make_motion_prior_from_limits(0.5, 0.5);
  for (const auto& [calibration, rejected] :
       {std::pair(rig.calibration, 0), {with_unknown_errors, 1}}) {
    const Fix fix = Positioner(rig.map, calibration).compute_position_fix(detections, driving);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_EQ(fix.rejected_lamps, rejected);
  }
}

}  // namespace
}  // namespace vlp
