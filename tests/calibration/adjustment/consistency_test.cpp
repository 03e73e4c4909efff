// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Consistency of the covariances of fixes, over whole recalibrations. Lens, survey, positions,
/// rotations and check captures have new noise each time. Boards are represented by a lens drawn
/// from its covariance.
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/adjustment/survey.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "support/station_verdicts.h"

namespace vlp {
namespace {

struct Case {
  const char* name;
  double map_sd_m;
  int places;
  /// Source of the lens: exact, calibrated with boards, or of another camera.
  enum { exact, boards, elsewhere } lens;
  bool refined;
};

class AdjustBundleCovariance : public testing::TestWithParam<Case> {};

/// Calibration and the map that belongs to it, from one survey.
struct Unit {
  Calibration calibration;
  LampMap map;
};

Unit calibrated(Survey& survey, const Case& the, Random& random) {
  Calibration& calibration = survey.input.calibration;
  if (the.lens == Case::boards) {
    draw_lens(calibration, lens_covariance(calibration.camera, 0.1, 8), random);
  } else if (the.lens == Case::elsewhere) {
    draw_lens(calibration, make_intrinsics_covariance(calibration.camera, 3), random);
  }
  survey.add_noise(random, true, true, true);
  const AdjustmentResult found = adjust_bundle(survey.input);
  EXPECT_TRUE(found.has_succeeded()) << found.undetermined;
  const LampMap map = the.refined ? found.refined_map : survey.input.lamps;
  const Adjustment adjustment{{"made up"}, found.captures, found.detections, found.residual_px};
  std::vector<JointCovariance::LampPosition> lamps;
  for (const Lamp& lamp : map.lamps) lamps.push_back({lamp.id, lamp.position_m});
  Calibration result = calibration;
  result.camera = found.camera;
  return {add_adjustment(
              result, found.center, adjustment,
              make_covariance(found.camera, lamps,
                              the.refined ? found.refined_covariance : found.surveyed_covariance),
              {}),
          map};
}

TEST_P(AdjustBundleCovariance, FixCovarianceMatchesFixErrorsAfterAdjustment) {
  const Case& the = GetParam();
  constexpr int trials = 200;
  Random random(20 + static_cast<std::uint64_t>(the.places));
  const std::vector<Eigen::Vector3d> axes_m{{-0.5, -0.25, 0}, {0.5, -0.2, 0.2}, {0, 0.3, 0.1}};
  NeesStatistics whole, common;
  for (int trial = 0; trial < trials; ++trial) {
    Survey survey(the.map_sd_m);
    for (std::size_t i = 0; i < 3; ++i) {
      survey.turn(axes_m[i], 6, static_cast<int>(i) < the.places ? 2e-4 : 0);
    }
    const Unit unit = calibrated(survey, the, random);
    const Positioner positioner(unit.map, unit.calibration);
    for (int k = 0; k < 5; ++k) {
      const double x_m = random.uniform(-0.6, 0.6), y_m = random.uniform(-0.3, 0.3);
      const double z_m = random.uniform(0, 0.3), yaw_rad = random.uniform(-3, 3);
      survey.truth.camera = {{x_m, y_m, z_m}, yaw_rad};
      const auto exact = seen_from(survey.truth, survey.sigma_px);
      const Fix fix = positioner.compute_position_fix(with_noise(exact, random));
      const Fix without_noise = positioner.compute_position_fix(exact);
      ASSERT_TRUE(fix.has_succeeded() && without_noise.has_succeeded());
      EXPECT_EQ(fix.rejected_lamps, 0);
      whole.add(compute_pose_error(fix, survey.truth.camera), fix.pose_covariance());
      common.add(compute_pose_error(without_noise, survey.truth.camera),
                 (without_noise.covariance - without_noise.noise_covariance).topLeftCorner<4, 4>());
    }
  }
  for (const NeesStatistics& judged : {whole, common}) {
    EXPECT_GT(judged.mean(), 0.9);
    EXPECT_LT(judged.mean(), 1.1);
    EXPECT_GT(judged.fraction(), 0.93);
    EXPECT_LT(judged.fraction(), 0.97);
  }
  RecordProperty("whole_permille", static_cast<int>(std::lround(1e3 * whole.mean())));
  std::printf("%s: whole %.3f, %.1f %%; common %.3f, %.1f %%\n", the.name, whole.mean(),
              100 * whole.fraction(), common.mean(), 100 * common.fraction());
}

INSTANTIATE_TEST_SUITE_P(
    Adjustment, AdjustBundleCovariance,
    testing::Values(Case{"GoodMapOnePlace", 1e-4, 1, Case::exact, true},
                    Case{"TapedMapThreePlaces", 2e-3, 3, Case::exact, true},
                    Case{"TapedMapOnePlaceAndLens", 2e-3, 1, Case::boards, true},
                    Case{"TapedMapThreePlacesAndLens", 2e-3, 3, Case::boards, true},
                    Case{"SurveyedMapThreePlacesAndLens", 2e-3, 3, Case::boards, false},
                    Case{"TapedMapThreePlacesAndLensFromElsewhere", 2e-3, 3, Case::elsewhere,
                         true}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vlp
