// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Accuracy of fixes and map over whole recalibrations in a room whose map was measured by tape or
/// by paces. Fixes are at other positions than the calibration captures.
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/adjustment/survey.h"
#include "rig/calibration_builder.h"
#include "support/station_verdicts.h"

namespace vlp {
namespace {

struct Means {
  double fix_xy_m = 0, fix_z_m = 0, map_xy_m = 0, map_z_m = 0;
  /// Mean squared normalized error e' cov^-1 e per coordinate, for all lamps of the map together.
  double map_squared = 0;
};

/// Returns means over trials: horizontal and vertical errors of the fixes, and of the lamps of the
/// map.
Means over_trials(double map_sd_m, bool places_are_wrong, int trials) {
  Random random(41);
  Means sums;
  constexpr int checks = 10;
  for (int trial = 0; trial < trials; ++trial) {
    Survey survey(map_sd_m);
    survey.five_places(1e-4);
    survey.add_noise(random, true, true, places_are_wrong);
    const AdjustmentResult found = adjust_bundle(survey.input);
    EXPECT_TRUE(found.has_succeeded()) << found.undetermined;
    Calibration calibration = survey.input.calibration;
    calibration.camera = found.camera;
    calibration.rotation_center = found.center;
    const Positioner positioner(found.refined_map, calibration);
    for (int k = 0; k < checks; ++k) {
      const double x_m = random.uniform(-0.6, 0.6), y_m = random.uniform(-0.3, 0.3);
      const double z_m = random.uniform(0, 0.3), yaw_rad = random.uniform(-3, 3);
      survey.truth.camera = {{x_m, y_m, z_m}, yaw_rad};
      const Fix fix = positioner.compute_position_fix(
          with_noise(seen_from(survey.truth, survey.sigma_px), random));
      EXPECT_TRUE(fix.has_succeeded());
      const Eigen::Vector4d error = compute_pose_error(fix, survey.truth.camera);
      sums.fix_xy_m += error.head<2>().norm() / (trials * checks);
      sums.fix_z_m += std::abs(error[2]) / (trials * checks);
    }
    Eigen::VectorXd errors_m(24);
    for (std::size_t i = 0; i < 8; ++i) {
      const Eigen::Vector3d error_m = survey.misplaced(i, found.refined_map);
      errors_m.segment<3>(3 * static_cast<Eigen::Index>(i)) = error_m;
      sums.map_xy_m += error_m.head<2>().norm() / (8 * trials);
      sums.map_z_m += std::abs(error_m.z()) / (8 * trials);
    }
    const Eigen::MatrixXd covariance = found.refined_covariance.bottomRightCorner<24, 24>();
    sums.map_squared += errors_m.dot(covariance.ldlt().solve(errors_m)) / (24 * trials);
  }
  return sums;
}

struct Room {
  const char* name;
  double map_sd_m;
  bool places_are_wrong;
  /// Upper limits of the means.
  Means limits;
};
class AdjustBundleAccuracy : public testing::TestWithParam<Room> {};

TEST_P(AdjustBundleAccuracy, KeepsMeanFixAndMapErrorsBelow150Micrometers) {
  const Room& the = GetParam();
  const Means found = over_trials(the.map_sd_m, the.places_are_wrong, 10);
  std::printf("%s: fixes %.4f mm, height %.4f mm; map %.4f mm, height %.4f mm, squared %.3f\n",
              the.name, 1e3 * found.fix_xy_m, 1e3 * found.fix_z_m, 1e3 * found.map_xy_m,
              1e3 * found.map_z_m, found.map_squared);
  EXPECT_LT(found.fix_xy_m, the.limits.fix_xy_m);
  EXPECT_LT(found.fix_z_m, the.limits.fix_z_m);
  EXPECT_LT(found.map_xy_m, the.limits.map_xy_m);
  EXPECT_LT(found.map_z_m, the.limits.map_z_m);
  if (the.places_are_wrong) {  // with errors of the given size
    EXPECT_NEAR(found.map_squared, 1, 0.25);
  }
}

// Limits for exact positions with a standard deviation of 0.1 mm, and for errors of this size.
constexpr Means kRight{6.5e-5, 8e-5, 5e-5, 1.5e-4}, kWrong{1.1e-4, 1e-4, 1.2e-4, 1.5e-4};
INSTANTIATE_TEST_SUITE_P(Adjustment, AdjustBundleAccuracy,
                         testing::Values(Room{"Taped", 0.002, false, kRight},
                                         Room{"TapedAndPlacesWrong", 0.002, true, kWrong},
                                         Room{"Paced", 0.02, false, kRight},
                                         Room{"PacedAndPlacesWrong", 0.02, true, kWrong}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace vlp
