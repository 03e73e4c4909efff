// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/valid_region.h"

#include <gtest/gtest.h>

#include "geometry/polygon.h"

namespace vlp {
namespace {

constexpr std::array kImager{801, 601};
constexpr double kMargin = 40;  // 4 % of 1000 px

TEST(ComputeValidLensRegion, ReturnsConvexHullOfCornersWithMargin) {
  const ImageRegion region = compute_valid_lens_region(
      {{200, 100}, {600, 100}, {400, 250}, {600, 500}, {200, 500}}, kImager, LensModel::opencv8);
  EXPECT_EQ(region.size(), 4U);
  EXPECT_NEAR(compute_region_fraction_of_image_area(region, kImager),
              (400 + 2 * kMargin) * (400 + 2 * kMargin) / (800 * 600), 1e-12);
  EXPECT_TRUE(polygon_contains(region, {161, 61}));
  EXPECT_TRUE(polygon_contains(region, {160, 300}));
  EXPECT_FALSE(polygon_contains(region, {159, 300}));
  EXPECT_FALSE(polygon_contains(region, {400, 541}));
}

TEST(ComputeValidLensRegion, ClipsRegionToImage) {
  const ImageRegion region = compute_valid_lens_region({{5, 5}, {790, 5}, {790, 590}, {5, 590}},
                                                       kImager, LensModel::opencv8);
  EXPECT_NEAR(compute_region_fraction_of_image_area(region, kImager), 1, 1e-12);
  for (const Eigen::Vector2d& corner : region) {
    EXPECT_TRUE(corner.x() == 0 || corner.x() == 800);
    EXPECT_TRUE(corner.y() == 0 || corner.y() == 600);
  }
  EXPECT_TRUE(polygon_contains(region, {800, 600}));
}

/// The edge from (-20, 260) to (360, -20), and its three mirror images, cross the image border
/// 245.26 px and 332.86 px from the nearest image corner.
TEST(ComputeValidLensRegion, SlantedEdgesEndAtTheirCrossingsWithImageBorder) {
  const ImageRegion region = compute_valid_lens_region(
      {{20, 300}, {400, 20}, {780, 300}, {400, 580}}, kImager, LensModel::opencv8);
  const double slope = 280. / 380;
  const double along_v = 260 - 20 * slope, along_u = along_v / slope;
  EXPECT_NEAR(compute_region_fraction_of_image_area(region, kImager),
              1 - 4 * along_u * along_v / 2 / (800 * 600), 1e-12);
  EXPECT_TRUE(polygon_contains(region, {along_u / 2 + 0.1, along_v / 2 + 0.1}));
  EXPECT_FALSE(polygon_contains(region, {along_u / 2 - 0.1, along_v / 2 - 0.1}));
  EXPECT_FALSE(polygon_contains(region, {800 - along_u / 2 + 0.1, 600 - along_v / 2 + 0.1}));
}

TEST(ComputeValidLensRegion, FollowsSlantedHullInsteadOfBoundingBox) {
  const ImageRegion region = compute_valid_lens_region(
      {{100, 100}, {700, 500}, {690, 510}, {90, 110}}, kImager, LensModel::opencv8);
  EXPECT_TRUE(polygon_contains(region, {400, 300}));
  EXPECT_FALSE(polygon_contains(region, {700, 100}));
  EXPECT_LT(compute_region_fraction_of_image_area(region, kImager), 0.3);
}

TEST(ComputeValidLensRegion, ReturnsEmptyRegionForCollinearCorners) {
  EXPECT_TRUE(compute_valid_lens_region({}, kImager, LensModel::opencv8).empty());
  EXPECT_TRUE(
      compute_valid_lens_region({{1, 1}, {2, 2}, {3, 3}, {9, 9}}, kImager, LensModel::opencv8)
          .empty());
  EXPECT_EQ(compute_region_fraction_of_image_area({}, kImager), 0);
}

}  // namespace
}  // namespace vlp
