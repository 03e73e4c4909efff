// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/residual_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "positioning/positioner.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kPixelSd_px = 0.3;

Fix fix_with(double chi_squared, double common_chi_squared, double degrees_of_freedom) {
  Fix fix;
  fix.status = FixStatus::ok;
  fix.chi_squared = chi_squared;
  fix.common_chi_squared = common_chi_squared;
  fix.redundancy = degrees_of_freedom;
  fix.sightings = 4;
  fix.residual_px = 0.5;
  return fix;
}

TEST(SumFixResiduals, IgnoresFailedFixesAndFixesWithoutRedundancy) {
  const std::vector<Fix> fixes{fix_with(12, 2, 8), Fix(), fix_with(5, 1, 0), fix_with(6, 0, 4)};
  const ResidualSums sums = sum_fix_residuals(fixes);
  EXPECT_EQ(sums.degrees_of_freedom, 12);
  EXPECT_EQ(sums.squares_px2, 2);
}

TEST(SumFixResiduals, ExcludesFixAbove25TimesMedianChiSquaredRatio) {
  // The median of 1, 1.25 and the third one's ratio is 1.25, and 25 times that is 31.25.
  for (const auto& [chi_squared, sum] : {std::pair(124.0, 12.0), {126.0, 8.0}, {3000.0, 8.0}}) {
    const std::vector<Fix> fixes{fix_with(5, 0, 4), fix_with(4, 0, 4), fix_with(chi_squared, 0, 4)};
    EXPECT_EQ(sum_fix_residuals(fixes).degrees_of_freedom, sum);
  }
}

/// Mean of chi_squared over fixes of a rig whose lamps have random offsets from the map.
class ComputeExpectedChiSquared : public testing::Test {
 protected:
  void SetUp() override {
    rig.map = synthetic_lamps();
    for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  }

  void expect_mean(const Sensors& sensors) {
    constexpr int draws = 4000;
    PositionerOptions options;
    options.max_residual_fraction = std::numeric_limits<double>::max();
    const Positioner positioner(rig.map, rig.calibration, options);
    double found = 0, redundancy = 0, common = 0;
    int fixes = 0, with_common = 0;
    for (int i = 0; i < draws; ++i) {
      SyntheticRig real = rig;
      for (Lamp& lamp : real.map.lamps) {
        for (double& coordinate : lamp.position_m) coordinate += *lamp.sd_m * random.normal();
      }
      const double sd_rad = sensors.inclination_sigma_rad;
      real.inclination = Inclination{sd_rad * random.normal(), sd_rad * random.normal()};
      const Fix fix = positioner.compute_position_fix(
          with_noise(seen_from(real, kPixelSd_px), random), sensors);
      // Draws without a fix or with a rejected lamp have the largest residuals: 1 in 10,000.
      if (!fix.has_succeeded() || fix.rejected_lamps > 0) continue;
      found += fix.chi_squared;
      redundancy += fix.redundancy;
      ++fixes;
      common += fix.common_chi_squared;
      with_common += fix.common_chi_squared > 0;
    }
    ASSERT_GT(with_common, draws / 4);
    const double expected = redundancy + fixes * common / with_common;
    EXPECT_GT(expected, 1.2 * redundancy);
    EXPECT_NEAR(found / expected, 1, 0.03);
  }

  SyntheticRig rig{{}, {synthetic_camera(), {}, {}, {}, {}}, {{0.1, -0.05, 0}, 0.4}, {}};
  Random random{5};
};

TEST_F(ComputeExpectedChiSquared, MatchesMeanChiSquaredOfStandingCamera) { expect_mean({}); }

TEST_F(ComputeExpectedChiSquared, MatchesMeanChiSquaredWithEstimatedTilt) {
  Sensors sensors;
  sensors.inclination_sigma_rad = 0.01;
  expect_mean(sensors);
}

}  // namespace
}  // namespace vlp
