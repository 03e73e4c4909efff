// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Monte Carlo test: the reported covariance of the tilt matches its scatter.
#include <gmock/gmock.h>

#include <cstdio>

#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"
#include "geometry/angles.h"
#include "support/estimate_scatter.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Drive under a map with errors of its sd_m.
struct TiltCase {
  const char* name;
  int captures;
  double map_sd_m = 0;
  bool noise_is_stated = true;
  /// Largest difference of a yaw from a common heading.
  double yaw_rad = 3;
  std::size_t lamps = 8;
  bool refine_map = false;
};

class EstimateTiltFromLampsScatter : public testing::TestWithParam<TiltCase> {};

/// 400 draws determine a standard deviation to 4 %.
TEST_P(EstimateTiltFromLampsScatter, ZenithErrorsMatchReportedCovariance) {
  constexpr int draws = 400;
  const TiltCase& drive = GetParam();
  Random random(26);
  SyntheticRig rig = make_tilted_rig(0.05, 1);
  rig.calibration.camera.lens_model = LensModel::pinhole;  // equal noise in the undistorted image
  rig.calibration.camera.intrinsics = {520, 520, 400, 300};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 1);
  TiltCalibrationOptions options;
  options.refine_map = drive.refine_map;
  EstimateScatter zenith, lamps;
  for (int i = 0; i < draws; ++i) {
    std::vector<Frame> frames;
    for (int k = 0; k < drive.captures; ++k) {
      const double x_m = random.uniform(-0.5, 0.5), y_m = random.uniform(-0.3, 0.3);
      rig.camera = {{x_m, y_m, k % 2 ? 0.3 : 0.0},
                    0.4 + random.uniform(-drive.yaw_rad, drive.yaw_rad)};
      frames.push_back({std::to_string(k), with_noise(seen_from(rig, 0.1), random)});
      frames.back().detections.resize(drive.lamps);
      for (Detection& detection : frames.back().detections) {
        if (!drive.noise_is_stated) detection.sigma_px.reset();
      }
    }
    LampMap surveyed = rig.map;
    for (Lamp& lamp : surveyed.lamps) {
      if (drive.map_sd_m > 0) lamp.sd_m = drive.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += drive.map_sd_m * random.normal();
    }
    const auto result = estimate_tilt_from_lamps(frames, surveyed, rig.calibration.camera, options);
    ASSERT_EQ(result.undetermined, "");
    ASSERT_EQ(result.covariance.rows(), 2);
    zenith.add(result.center.zenith_in_camera.hnormalized() -
                   rig.calibration.rotation_center->zenith_in_camera.hnormalized(),
               result.covariance);
    if (!drive.refine_map) continue;
    // The map has no errors: corrections are errors.
    ASSERT_EQ(result.corrections.size(), 8U);
    Eigen::VectorXd error(24), variances(24);
    for (Eigen::Index k = 0; k < 8; ++k) {
      const auto& correction = result.corrections[static_cast<std::size_t>(k)];
      error.segment<3>(3 * k) = correction.correction_m;
      variances.segment<3>(3 * k) = correction.sd_m.cwiseAbs2();
    }
    lamps.add(error, variances.asDiagonal());
  }
  const Eigen::VectorXd ratios = zenith.sd_ratios();
  std::printf("%s: e/sd %.2f %.2f\n", drive.name, ratios[0], ratios[1]);
  EXPECT_THAT(ratios, IsNear(Eigen::Vector2d(1, 1), 0.13));
  EXPECT_LT(zenith.correlation_difference().cwiseAbs().maxCoeff(), 0.15);
  if (drive.refine_map) EXPECT_THAT(lamps.sd_ratios(), IsNear(Eigen::VectorXd::Ones(24), 0.15));
}

INSTANTIATE_TEST_SUITE_P(
    Tilt, EstimateTiltFromLampsScatter,
    testing::Values(TiltCase{"ExactMap", 12}, TiltCase{"ExactMapNoiseNotStated", 12, 0, false},
                    TiltCase{"ThreeLamps", 30, 0, true, 3, 3},
                    TiltCase{"RefinedMap", 16, 0, true, 3, 8, true},
                    TiltCase{"OneWayMapErrors", 40, 2e-3, true, rad_from_deg(10)},
                    TiltCase{"AnyYawMapErrorsNoiseNotStated", 40, 2e-3, false},
                    TiltCase{"FewCapturesMapErrors", 8, 2e-3}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vlp
