// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/inverse_height.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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
    lamp.position_in_plane = (lamp.position_m - camera_m) / (height_m + lamp.height_beyond_first_m);
  return lamps;
}

TEST(EstimateInverseHeight, IsExactForLampsAtSeveralHeights) {
  for (const double height_m : {0.8, 2.0, 5.0}) {
    const auto inverse_height = estimate_inverse_height(project_lamps(height_m, {0.3, -0.2}));
    ASSERT_TRUE(inverse_height);
    EXPECT_NEAR(inverse_height->log_value, -std::log(height_m), 1e-12);
    EXPECT_NEAR(inverse_height->compute_radius_in_plane(0.1, 0.3), 0.1 / (height_m + 0.3), 1e-12);
  }
}

TEST(EstimateInverseHeight, IgnoresOneWrongLamp) {
  auto lamps = project_lamps(2, {0.3, -0.2});
  lamps.push_back({{0.9, 0.9}, {-1.5, -1.5}, 0, 0.1});
  const auto inverse_height = estimate_inverse_height(lamps);
  ASSERT_TRUE(inverse_height);
  EXPECT_NEAR(inverse_height->log_value, -std::log(2), 0.05);
}

TEST(EstimateInverseHeight, StandardDeviationIsThatOfTheDistance) {
  const auto inverse_height =
      estimate_inverse_height({{{0, 0}, {0, 0}, 0, 0.1}, {{0.5, 0}, {1, 0}, 0, 0.1}});
  ASSERT_TRUE(inverse_height);
  EXPECT_NEAR(inverse_height->log_value, -std::log(2), 1e-12);
  EXPECT_NEAR(inverse_height->log_sd, 0.1 * std::numbers::sqrt2 / 1, 1e-12);
}

TEST(EstimateInverseHeight, ReturnsNulloptForFewOrCloseLamps) {
  EXPECT_FALSE(estimate_inverse_height({}));
  EXPECT_FALSE(estimate_inverse_height({{{0, 0}, {0, 0}, 0, 0.1}}));
  EXPECT_FALSE(estimate_inverse_height({{{0, 0}, {0, 0}, 0, 0.1}, {{0.1, 0}, {0.2, 0}, 0, 0.1}}));
  EXPECT_FALSE(estimate_inverse_height({{{0.1, 0}, {0, 0}, 0, 0.1}, {{0.1, 0}, {2, 0}, 0, 0.1}}));
}

/// Returns the radii of lamps at several heights, the first one by a factor wrong.
std::vector<LampRadius> make_radii(double height_m, double factor_of_first) {
  std::vector<LampRadius> radii{{0, 0.1, 0}, {0, 0.1, 0.3}, {0, 0.08, -0.2}, {0, 0.15, 0}};
  for (LampRadius& lamp : radii)
    lamp.radius_in_plane = lamp.radius_m / (height_m + lamp.height_beyond_first_m);
  radii.front().radius_in_plane *= factor_of_first;
  return radii;
}

TEST(EstimateInverseHeightFromRadii, IsExactIfMostRadiiAgree) {
  for (const double factor : {1.0, 0.7, 1.5}) {
    const auto inverse_height = estimate_inverse_height_from_radii(make_radii(2, factor));
    ASSERT_TRUE(inverse_height) << factor;
    EXPECT_NEAR(inverse_height->log_value, -std::log(2), 1e-12) << factor;
    EXPECT_NEAR(inverse_height->log_sd, 0.005, 1e-12) << factor;
  }
}

TEST(EstimateInverseHeightFromRadii, StandardDeviationIsScatterOfRadii) {
  const auto inverse_height = estimate_inverse_height_from_radii(
      {{0.1, 0.2, 0}, {0.1 * std::exp(0.1), 0.2, 0}, {0.1 * std::exp(-0.1), 0.2, 0}});
  ASSERT_TRUE(inverse_height);
  EXPECT_NEAR(inverse_height->log_value, -std::log(2), 1e-12);
  EXPECT_NEAR(inverse_height->log_sd, 1.4826 * 0.1, 1e-12);
}

TEST(EstimateInverseHeightFromRadii, ReturnsNulloptForLessThanThreeLamps) {
  EXPECT_FALSE(estimate_inverse_height_from_radii({}));
  EXPECT_FALSE(estimate_inverse_height_from_radii({{0.1, 0.2, 0}, {0.1, 0.2, 0}}));
}

}  // namespace
}  // namespace vlp
