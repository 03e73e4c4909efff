// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Error propagation through sequential calibration: the covariance of fixes includes the errors of
/// lens, rotation and dispersion.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>

#include "calibration/adjustment/survey.h"
#include "positioning/correlated_errors.h"
#include "rig/calibration_error.h"
#include "session/dispersion_step.h"
#include "session/rotation_step.h"
#include "support/body_rig.h"
#include "support/joint_covariance.h"
#include "support/station_verdicts.h"

namespace vlp {
namespace {

constexpr double kExactMap_m = 1e-9;

/// Rotation in place at two heights, and captures at a known place of the camera or of the axis, at
/// yaws over a quarter turn: errors of the lever arm do not average out.
struct CalibrationChain {
  Survey survey{kExactMap_m};
  LampCaptures turns;
  KnownPositions known;

  CalibrationChain(Random& random, double lens_px, MeasuredPoint of = MeasuredPoint::camera) {
    for (const double z_m : {0.0, 0.4}) survey.turn({0.1, -0.05, z_m}, 9);
    const std::size_t on_the_spot = survey.input.captures.size();
    const Eigen::Vector3d place_m(-0.2, 0.1, 0);
    for (int k = 0; k < 6; ++k) {
      if (of == MeasuredPoint::camera) {
        survey.stand({place_m, 1.0 * k});
        continue;
      }
      const double yaw_rad = 0.3 * k;
      Eigen::Vector3d arm_m = Eigen::Vector3d::Zero();
      arm_m.head<2>() = survey.lever_arm_m;
      survey.stand({place_m + rotation_about_z(yaw_rad) * arm_m, yaw_rad});
    }
    Calibration& calibration = survey.input.calibration;
    if (lens_px > 0) {
      draw_lens(calibration, lens_covariance(calibration.camera, lens_px, 8), random);
      survey.add_noise(random, true, false, false);
    }
    turns = {{}, survey.truth.map, "lamps.yaml", calibration};
    const auto& captures = survey.input.captures;
    for (std::size_t i = 0; i < captures.size(); ++i) {
      if (i < on_the_spot) {
        turns.frames.push_back({captures[i].name, captures[i].detections});
      } else {
        known.captures.push_back({captures[i].detections, place_m.head<2>()});
        known.measured_points.push_back(of);
      }
    }
  }

  Calibration calibrated() const {
    const RotationResult rotation = run_rotation_step(turns, RotationMethod::axis, {});
    EXPECT_TRUE(rotation.has_succeeded()) << rotation.message;
    LampCaptures leveled = turns;
    leveled.calibration = rotation.calibration;
    const DispersionResult dispersion =
        run_dispersion_step(leveled, known, DispersionMethod::camera, DispersionCircle::mean, {});
    EXPECT_TRUE(dispersion.has_succeeded());
    return dispersion.calibration;
  }
};

TEST(SequentialCalibration, JointCovarianceLacksLensWithoutLensCovariance) {
  Random random(1);
  const Calibration calibration = CalibrationChain(random, 0).calibrated();
  ASSERT_TRUE(calibration.covariance);
  EXPECT_FALSE(calibration.covariance->find_row("fx"));
  for (const std::string_view name : {kZenithParameter, kLeverArmParameter, kOffsetParameter})
    EXPECT_TRUE(calibration.covariance->find_row(name)) << name;
}

TEST(SequentialCalibration, JointCovarianceWithLensPredictsChangeOfZenithAndOffset) {
  Random random(2);
  CalibrationChain row(random, 0);
  Calibration& calibration = row.turns.calibration;
  const Eigen::MatrixXd covariance = lens_covariance(calibration.camera, 0.1, 8);
  calibration.intrinsics_report = IntrinsicsReport{40, 4000, 0, 0.1, {}, {}, covariance};
  const Calibration exact = row.calibrated();
  draw_lens(calibration, covariance, random);
  const Camera& camera = row.survey.truth.calibration.camera;
  Eigen::VectorXd error(covariance.rows());
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    error[i] = calibration.camera.intrinsics[k] - camera.intrinsics[k];
  }
  const Calibration moved = row.calibrated();
  const Eigen::Vector2d zenith =
      compute_zenith_point(*moved.rotation_center) - compute_zenith_point(*exact.rotation_center);
  ASSERT_TRUE(exact.covariance);
  const Eigen::Vector2d zenith_said =
      derivative_by_lens(*exact.covariance, kZenithParameter, error.size()) * error;
  EXPECT_GT(zenith.norm(), 1e-6);
  EXPECT_LT((zenith - zenith_said).norm(), 0.02 * zenith.norm());
  const Eigen::Vector2d offset =
      moved.dispersion->offset_px.cwiseQuotient(moved.camera.focal_px()) -
      exact.dispersion->offset_px.cwiseQuotient(exact.camera.focal_px());
  const Eigen::Vector2d offset_said =
      derivative_by_lens(*exact.covariance, kOffsetParameter, error.size()) * error;
  EXPECT_GT(offset.norm(), 1e-6);
  // The effects of lens and zenith mostly cancel.
  EXPECT_LT((offset - offset_said).norm(), 0.02 * zenith.norm());
}

class SequentialCalibrationFixes : public testing::TestWithParam<MeasuredPoint> {};

TEST_P(SequentialCalibrationFixes, FixCovarianceMatchesErrorsOfFixes) {
  constexpr int trials = 40;
  Random random(3);
  NeesStatistics whole, common;
  double zenith = 0, offset = 0;  // e' cov^-1 e per coordinate
  for (int trial = 0; trial < trials; ++trial) {
    CalibrationChain row(random, 0.1, GetParam());
    const Calibration calibration = row.calibrated();
    const Eigen::Vector2d zenith_error =
        compute_zenith_point(*calibration.rotation_center) -
        compute_zenith_point(*row.survey.truth.calibration.rotation_center);
    const Eigen::Vector2d& offset_px = calibration.dispersion->offset_px;
    const auto squared = [](const Eigen::Vector2d& error, const Eigen::Matrix2d& covariance) {
      return error.dot(covariance.inverse() * error) / (2 * trials);
    };
    zenith += squared(zenith_error, *find_parameter_covariance(calibration, kZenithParameter));
    offset += squared(offset_px, *compute_offset_covariance(calibration));
    const Positioner positioner(row.survey.truth.map, calibration);
    for (int k = 0; k < 5; ++k) {
      const double x_m = random.uniform(-0.6, 0.6), y_m = random.uniform(-0.3, 0.3);
      const double z_m = random.uniform(0, 0.3), yaw_rad = random.uniform(-3, 3);
      row.survey.truth.camera = {{x_m, y_m, z_m}, yaw_rad};
      const auto exact = seen_from(row.survey.truth, row.survey.sigma_px);
      const Fix fix = positioner.compute_position_fix(with_noise(exact, random));
      const Fix without_noise = positioner.compute_position_fix(exact);
      ASSERT_TRUE(fix.has_succeeded() && without_noise.has_succeeded());
      whole.add(compute_pose_error(fix, row.survey.truth.camera), fix.pose_covariance());
      common.add(compute_pose_error(without_noise, row.survey.truth.camera),
                 (without_noise.covariance - without_noise.noise_covariance).topLeftCorner<4, 4>());
    }
  }
  // Fixes of one trial are correlated: three standard errors for `trials` trials.
  for (const NeesStatistics& judged : {whole, common}) {
    EXPECT_NEAR(judged.mean(), 1, 0.3);
    EXPECT_GT(judged.fraction(), 0.88);
  }
  EXPECT_NEAR(zenith, 1, 0.45);
  EXPECT_NEAR(offset, 1, 0.45);
  std::printf("zenith %.2f, offset %.2f\n", zenith, offset);
  std::printf("whole %.3f, %.1f %%; common %.3f, %.1f %%\n", whole.mean(), 100 * whole.fraction(),
              common.mean(), 100 * common.fraction());
}

INSTANTIATE_TEST_SUITE_P(Places, SequentialCalibrationFixes,
                         testing::Values(MeasuredPoint::camera, MeasuredPoint::axis),
                         [](const auto& one) {
                           return one.param == MeasuredPoint::camera ? "FromAPlaceOfTheCamera"
                                                                     : "FromAPlaceOfTheAxis";
                         });

}  // namespace
}  // namespace vlp
