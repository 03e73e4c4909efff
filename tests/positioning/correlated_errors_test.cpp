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
  const Adjustment adjustment = *rig.calibration.adjustment;
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
      other = add_error_to_calibrated_intrinsics(other, by * Eigen::VectorXd::Unit(12, parameter));
    } else if (parameter < 14) {
      other = add_error_to_calibrated_zenith(other, by * Eigen::Vector2d::Unit(parameter - 12));
    } else if (parameter >= 16) {
      map.lamps[static_cast<std::size_t>(parameter - 16) / 3].position_m[(parameter - 16) % 3] +=
          by;
    }
    other.adjustment.reset();
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
  expect_common(fix, by_parameters, adjustment.covariance);
  rig.calibration.adjustment.reset();
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
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m.reset();
  const MatrixX covariance = *rig.calibration.intrinsics_report->covariance;
  const auto detections = seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    const Calibration other = add_error_to_calibrated_intrinsics(
        rig.calibration, by * Eigen::VectorXd::Unit(12, parameter));
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

/// A part without derivatives by the lens hides the errors of the lens.
TEST_F(CommonErrorsTest, LensErrorsAreUnknownIfAppliedCorrectionHasNoJacobianWrtLens) {
  const auto stated = [&](Correction correction) {
    return CommonErrors(rig.map.lamps, rig.calibration, correction)
        .is_error_source_known_or_absent(CommonErrorSource::lens);
  };
  rig.calibrate_in_a_row();
  for (const Correction correction :
       {Correction::none, Correction::rotation, Correction::dispersion, Correction::all}) {
    EXPECT_TRUE(stated(correction));
  }
  rig.calibration.rotation_center->jacobian_wrt_intrinsics.reset();
  EXPECT_FALSE(stated(Correction::rotation) || stated(Correction::all));
  EXPECT_TRUE(stated(Correction::dispersion));
  rig.calibration.dispersion->jacobian_wrt_intrinsics.reset();
  EXPECT_FALSE(stated(Correction::dispersion));
  EXPECT_TRUE(stated(Correction::none));
}

TEST_F(CommonErrorsTest, FixCovarianceIncludesSurveySdOfLamps) {
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(seen_from(rig, 0.1));
  ASSERT_TRUE(fix.has_succeeded());
  const Matrix4 common = (fix.covariance - fix.noise_covariance).topLeftCorner<4, 4>();
  // Eight lamps of 2 mm around the camera: slightly more than 2 / sqrt(8).
  EXPECT_NEAR(std::sqrt(common(0, 0)), 0.00075, 0.00008);
}

/// Lamps of a dispersion have rows in the joint covariance; a derivative of 0 adds no error to it.
TEST_F(CommonErrorsTest, FixCovarianceIsUnchangedByDispersionLampsWithZeroJacobian) {
  rig.calibrate_in_a_row();
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  rig.calibration.dispersion->uncertain_lamps.clear();
  const auto detections = seen_from(rig, 0.1);
  const Fix without = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  const CommonErrors small(rig.map.lamps, rig.calibration, Correction::all);
  for (const Lamp& lamp : rig.map.lamps) {
    rig.calibration.dispersion->uncertain_lamps.push_back(
        {lamp.id, lamp.position_m, *lamp.sd_m, Eigen::Matrix<double, 2, 3>::Zero()});
  }
  const CommonErrors large(rig.map.lamps, rig.calibration, Correction::all);
  EXPECT_EQ(small.joint_error_covariance().rows(), small.num_shared_errors());
  EXPECT_EQ(large.joint_error_covariance().rows(),
            large.num_shared_errors() + 3 * std::ssize(rig.map.lamps));
  const Fix with = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  ASSERT_TRUE(with.has_succeeded() && without.has_succeeded());
  const double scale = with.pose_covariance().norm();
  EXPECT_THAT(without.pose_covariance(), IsNear(with.pose_covariance(), 1e-12 * scale));
  EXPECT_TRUE(small.are_any_errors_known() &&
              small.isolate_error_source(CommonErrorSource::lamps).are_any_errors_known());
}

/// The offset depends on a lamp of the adjustment, whose error is not in the survey.
TEST_F(CommonErrorsTest, DispersionOffsetCovarianceIncludesErrorOfAdjustedLamp) {
  rig.adjust(1);
  Eigen::Matrix<double, 2, 3> by_position;
  by_position << 0.5, -0.1, 0.2, 0.1, 0.6, -0.3;
  Dispersion& dispersion = rig.calibration.dispersion.emplace();
  dispersion = {{0.4, -0.3}, 0.001, {0, 0}, 12};
  dispersion.jacobian_wrt_zenith = Eigen::Matrix2d::Zero();
  dispersion.uncertain_lamps = {{2, rig.map.lamps[1].position_m, 0.001, by_position}};
  const CommonErrors errors(rig.map.lamps, rig.calibration, Correction::all);
  const Eigen::Matrix3d lamp = rig.calibration.adjustment->covariance.block<3, 3>(19, 19);
  ASSERT_EQ(errors.joint_error_covariance().rows(), 12 + 2 + 2 + 24);
  const Eigen::Matrix2d offset = errors.joint_error_covariance().block<2, 2>(14, 14);
  const Eigen::Matrix<double, 2, 3> mixed = errors.joint_error_covariance().block<2, 3>(14, 19);
  EXPECT_THAT(offset, IsNear((by_position * lamp * by_position.transpose()).eval(), 1e-18));
  EXPECT_THAT(mixed, IsNear((by_position * lamp).eval(), 1e-18));
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

TEST_F(CommonErrorsTest, PositionFixRejectsLampMovedBy30MmAmongFour) {
  rig.adjust(0.3);
  SyntheticRig room = rig;
  room.map.lamps[1].position_m.x() += 0.03;
  auto detections = seen_from(room, 0.03);
  ASSERT_EQ(detections.size(), 8);
  detections.resize(4);
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_EQ(fix.rejected_lamps, 1);
  EXPECT_EQ(fix.rejected_ids[0], 2);
}

/// Sequential steps; all covariances are combined by hand.
class StepCovariance : public testing::Test {
 protected:
  StatedRig rig;
  Calibration& calibration = rig.calibration;

  void SetUp() override { rig.calibrate_in_a_row(); }
  Eigen::Matrix2d per_focal(const Matrix2& covariance_px) const {
    const Eigen::Vector2d inverse = calibration.camera.focal_px().cwiseInverse();
    return inverse.asDiagonal() * covariance_px * inverse.asDiagonal();
  }
  MatrixX lens() const { return *calibration.intrinsics_report->covariance; }
  static void expect_equal(const std::optional<Matrix2>& found, const Eigen::Matrix2d& expected) {
    ASSERT_TRUE(found);
    EXPECT_THAT(*found, IsNear(expected, 1e-12 * expected.norm()));
  }
};

class ComputeZenithCovariance : public StepCovariance {};
class ComputeDispersionOffsetCovariance : public StepCovariance {};

TEST_F(ComputeZenithCovariance, SumsCovariancesOfCapturesAndLensUnlessAdjusted) {
  const RotationCenter& center = *calibration.rotation_center;
  const MatrixX by_lens = *center.jacobian_wrt_intrinsics;
  expect_equal(compute_zenith_covariance(calibration),
               per_focal(*center.covariance) + by_lens * lens() * by_lens.transpose());
  calibration.intrinsics_report.reset();
  expect_equal(compute_zenith_covariance(calibration), per_focal(*center.covariance));
  rig.adjust(1);
  expect_equal(compute_zenith_covariance(calibration),
               calibration.adjustment->covariance.block<2, 2>(12, 12));
}

TEST_F(ComputeZenithCovariance, ReturnsNulloptWithoutCovarianceOrLensDerivatives) {
  calibration.rotation_center->jacobian_wrt_intrinsics.reset();
  EXPECT_FALSE(compute_zenith_covariance(calibration));
  SetUp();
  calibration.rotation_center->covariance.reset();
  EXPECT_FALSE(compute_zenith_covariance(calibration));
}

TEST_F(ComputeDispersionOffsetCovariance, SumsCovariancesOfCapturesLensZenithAndLamps) {
  Dispersion& dispersion = *calibration.dispersion;
  Eigen::Matrix<double, 2, 3> by_position;
  by_position << 0.5, -0.1, 0.2, 0.1, 0.6, -0.3;
  dispersion.uncertain_lamps = {{1, rig.map.lamps[0].position_m, 0.002, by_position}};
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  const MatrixX by_lens =
      *dispersion.jacobian_wrt_intrinsics +
      *dispersion.jacobian_wrt_zenith * *calibration.rotation_center->jacobian_wrt_intrinsics;
  const Eigen::Matrix2d expected =
      per_focal(*dispersion.covariance) + by_lens * lens() * by_lens.transpose() +
      *dispersion.jacobian_wrt_zenith * per_focal(*calibration.rotation_center->covariance) *
          dispersion.jacobian_wrt_zenith->transpose() +
      0.002 * 0.002 * by_position * by_position.transpose();
  expect_equal(compute_dispersion_offset_covariance(calibration),
               focal_px.asDiagonal() * expected * focal_px.asDiagonal());
}

TEST_F(ComputeDispersionOffsetCovariance, ReturnsNulloptWithoutRequiredCovariancesOrDerivatives) {
  EXPECT_TRUE(compute_dispersion_offset_covariance(calibration));
  calibration.dispersion->jacobian_wrt_zenith.reset();
  EXPECT_FALSE(compute_dispersion_offset_covariance(calibration));
  SetUp();
  calibration.dispersion->jacobian_wrt_intrinsics.reset();
  EXPECT_FALSE(compute_dispersion_offset_covariance(calibration));
  SetUp();
  calibration.dispersion->covariance.reset();
  EXPECT_FALSE(compute_dispersion_offset_covariance(calibration));
  SetUp();
  calibration.rotation_center->covariance.reset();
  EXPECT_FALSE(compute_dispersion_offset_covariance(calibration));
  calibration.rotation_center.reset();
  calibration.intrinsics_report.reset();
  calibration.dispersion->jacobian_wrt_intrinsics.reset();
  const auto alone = compute_dispersion_offset_covariance(calibration);
  expect_equal(alone, *calibration.dispersion->covariance);
}

}  // namespace
}  // namespace vlp
