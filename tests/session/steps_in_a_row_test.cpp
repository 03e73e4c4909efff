// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What each step passes on of what it got: fixes that know what lens, rotation and dispersion
/// left.
#include <gtest/gtest.h>

#include "calibration/adjustment/survey.h"
#include "rig/calibration_error.h"
#include "session/dispersion_step.h"
#include "session/rotation_step.h"
#include "support/judged.h"

namespace vlp {
namespace {

constexpr double kExactMap_m = 1e-9;

/// A turn on the spot at two heights, and captures at a known place of the camera.
struct Row {
  Survey survey{kExactMap_m};
  LampCaptures turns;
  KnownPlaces known;

  Row(Random& random, double lens_px) {
    for (const double z_m : {0.0, 0.4}) survey.turn({0.1, -0.05, z_m}, 9);
    const std::size_t on_the_spot = survey.input.captures.size();
    for (int k = 0; k < 6; ++k) survey.stand({{-0.2, 0.1, 0.0}, 1.0 * k});
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
        known.captures.push_back({captures[i].detections, {-0.2, 0.1}});
        known.of.push_back(PlaceOf::camera);
      }
    }
  }

  Calibration calibrated() const {
    const RotationResult rotation = solve_rotation(turns, RotationMethod::axis, {});
    EXPECT_TRUE(rotation.ok()) << rotation.why;
    LampCaptures levelled = turns;
    levelled.calibration = rotation.calibration;
    const DispersionResult dispersion =
        solve_dispersion(levelled, known, DispersionMethod::camera, DispersionCircle::mean, {});
    EXPECT_TRUE(dispersion.ok());
    return dispersion.calibration;
  }
};

TEST(StepsInARow, PassOnNothingWhereTheLensSaysNothing) {
  Random random(1);
  const Calibration calibration = Row(random, 0).calibrated();
  EXPECT_FALSE(calibration.rotation_center->by_intrinsics);
  EXPECT_FALSE(calibration.dispersion->by_intrinsics);
}

TEST(StepsInARow, MoveWithTheLensAsTheySay) {
  Random random(2);
  Row row(random, 0);
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
      zenith_point(*moved.rotation_center) - zenith_point(*exact.rotation_center);
  const Eigen::Vector2d zenith_said = *exact.rotation_center->by_intrinsics * error;
  EXPECT_GT(zenith.norm(), 1e-6);
  EXPECT_LT((zenith - zenith_said).norm(), 0.02 * zenith.norm());
  const Eigen::Vector2d offset =
      moved.dispersion->offset_px.cwiseQuotient(focal_px_of(moved.camera)) -
      exact.dispersion->offset_px.cwiseQuotient(focal_px_of(exact.camera));
  const Eigen::Vector2d offset_said =
      *exact.dispersion->by_intrinsics * error + *exact.dispersion->by_zenith * zenith;
  EXPECT_GT(offset.norm(), 1e-6);
  // What lens and zenith do mostly takes each other back.
  EXPECT_LT((offset - offset_said).norm(), 0.02 * zenith.norm());
}

TEST(StepsInARow, FixesSayWhatTheirErrorIsOverRecalibrations) {
  constexpr int trials = 40;
  Random random(3);
  Judged whole, common;
  for (int trial = 0; trial < trials; ++trial) {
    Row row(random, 0.1);
    const Positioner positioner(row.survey.truth.map, row.calibrated());
    for (int k = 0; k < 5; ++k) {
      const double x_m = random.uniform(-0.6, 0.6), y_m = random.uniform(-0.3, 0.3);
      const double z_m = random.uniform(0, 0.3), yaw_rad = random.uniform(-3, 3);
      row.survey.truth.camera = {{x_m, y_m, z_m}, yaw_rad};
      const auto exact = seen_from(row.survey.truth, row.survey.sigma_px);
      const Fix fix = positioner.locate(with_noise(exact, random));
      const Fix without_noise = positioner.locate(exact);
      ASSERT_TRUE(fix.ok() && without_noise.ok());
      whole.add(error_of(fix, row.survey.truth.camera), fix.estimate.covariance);
      common.add(error_of(without_noise, row.survey.truth.camera),
                 without_noise.estimate.covariance - without_noise.noise_covariance);
    }
  }
  // Fixes of one trial go together: three standard errors of so few.
  for (const Judged& judged : {whole, common}) {
    EXPECT_NEAR(judged.mean(), 1, 0.3);
    EXPECT_GT(judged.share(), 0.88);
  }
}

}  // namespace
}  // namespace vlp
