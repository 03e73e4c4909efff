// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

TEST(MakeRegularPixelGrid, CoversImageIncludingItsEdges) {
  const auto grid = make_regular_pixel_grid({401, 301}, 9);
  ASSERT_EQ(grid.size(), 9U * 7U);
  EXPECT_EQ(grid[0], Eigen::Vector2d(0, 0));
  EXPECT_EQ(grid[1], Eigen::Vector2d(50, 0));
  EXPECT_EQ(grid[9], Eigen::Vector2d(0, 50));
  EXPECT_EQ(grid.back(), Eigen::Vector2d(400, 300));
  EXPECT_EQ(make_regular_pixel_grid({300, 400}, 3).size(), 3U * 4U);
  EXPECT_EQ(make_regular_pixel_grid({1000, 10}, 4).size(), 4U * 2U) << "two rows at least";
}

TEST(ComputeProjectionDifference, ReturnsZeroForIdenticalLenses) {
  const Lens lens = synthetic_lens();
  EXPECT_LT(compute_projection_difference(lens, lens, {800, 600}, even).value().worst_px, 1e-6);
}

// A displaced center is equivalent to a rotation, except for terms of second order in the angle.
TEST(ComputeProjectionDifference, IgnoresPrincipalPointShiftEquivalentToRotation) {
  const std::array near{3000.0, 3000.0, 400.0, 300.0}, shifted{3000.0, 3000.0, 403.0, 300.0};
  const auto difference = compute_projection_difference(
      Lens(LensModel::pinhole, near), Lens(LensModel::pinhole, shifted), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->worst_px, 0.1);
}

TEST(ComputeProjectionDifference, WorstPixelMatchesFocalLengthDifferenceAtImageCorner) {
  const std::array one{500.0, 500.0, 399.5, 299.5}, other{501.0, 501.0, 399.5, 299.5};
  const auto difference = compute_projection_difference(
      Lens(LensModel::pinhole, one), Lens(LensModel::pinhole, other), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_NEAR(difference->worst_px, 500.0 / 500, 0.01);  // the corner, 500 px from the center
}

}  // namespace
}  // namespace vlp
