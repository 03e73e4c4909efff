// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/plane_ratio.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

using Eigen::Vector2d;

/// Returns lamps seen by a camera at `camera_m`, `height_m` below the first one.
std::vector<LampInPlane> project_lamps(double height_m, const Vector2d& camera_m) {
  std::vector<LampInPlane> lamps{{{}, {0, 0}, 0, 0.1},
                                 {{}, {1.2, 0.1}, 0.3, 0.1},
                                 {{}, {-0.4, 0.9}, -0.2, 0.15},
                                 {{}, {0.8, -1.1}, 0, 0.1}};
  for (LampInPlane& lamp : lamps)
    lamp.position = (lamp.position_m - camera_m) / (height_m + lamp.above_m);
  return lamps;
}

TEST(EstimatePlaneRatio, IsExactForLampsAtSeveralHeights) {
  for (const double height_m : {0.8, 2.0, 5.0}) {
    const auto ratio = estimate_plane_ratio(project_lamps(height_m, {0.3, -0.2}));
    ASSERT_TRUE(ratio);
    EXPECT_NEAR(ratio->log_ratio, -std::log(height_m), 1e-12);
    EXPECT_NEAR(ratio->compute_radius_in_plane(0.1, 0.3), 0.1 / (height_m + 0.3), 1e-12);
  }
}

TEST(EstimatePlaneRatio, IgnoresOneWrongLamp) {
  auto lamps = project_lamps(2, {0.3, -0.2});
  lamps.push_back({{0.9, 0.9}, {-1.5, -1.5}, 0, 0.1});
  const auto ratio = estimate_plane_ratio(lamps);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(ratio->log_ratio, -std::log(2), 0.05);
}

TEST(EstimatePlaneRatio, StandardDeviationIsThatOfCentersAnywhereInTheLamps) {
  const auto ratio = estimate_plane_ratio({{{0, 0}, {0, 0}, 0, 0.1}, {{0.5, 0}, {1, 0}, 0, 0.1}});
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(ratio->log_ratio, -std::log(2), 1e-12);
  EXPECT_NEAR(ratio->sd, 0.5 * 0.2 / 1, 1e-12);
}

TEST(EstimatePlaneRatio, ReturnsNulloptForFewOrCloseLamps) {
  EXPECT_FALSE(estimate_plane_ratio({}));
  EXPECT_FALSE(estimate_plane_ratio({{{0, 0}, {0, 0}, 0, 0.1}}));
  EXPECT_FALSE(estimate_plane_ratio({{{0, 0}, {0, 0}, 0, 0.1}, {{0.1, 0}, {0.2, 0}, 0, 0.1}}));
  EXPECT_FALSE(estimate_plane_ratio({{{0.1, 0}, {0, 0}, 0, 0.1}, {{0.1, 0}, {2, 0}, 0, 0.1}}));
}

}  // namespace
}  // namespace vlp
