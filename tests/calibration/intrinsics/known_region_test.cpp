// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/known_region.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace vlp {
namespace {

constexpr std::array kImager{801, 601};
constexpr double kMargin = 40;  // 4 % of 1000 px

TEST(KnownRegion, IsTheHullWithAMargin) {
  const ImageRegion region = known_region(
      {{200, 100}, {600, 100}, {400, 250}, {600, 500}, {200, 500}}, kImager, LensModel::opencv8);
  EXPECT_EQ(region.size(), 4U);
  EXPECT_NEAR(share_of_image(region, kImager),
              (400 + 2 * kMargin) * (400 + 2 * kMargin) / (800 * 600), 1e-12);
  EXPECT_TRUE(lies_in(region, {161, 61}));
  EXPECT_TRUE(lies_in(region, {160, 300}));
  EXPECT_FALSE(lies_in(region, {159, 300}));
  EXPECT_FALSE(lies_in(region, {400, 541}));
}

TEST(KnownRegion, EndsWithTheImage) {
  const ImageRegion region =
      known_region({{5, 5}, {790, 5}, {790, 590}, {5, 590}}, kImager, LensModel::opencv8);
  EXPECT_NEAR(share_of_image(region, kImager), 1, 1e-12);
  for (const Eigen::Vector2d& corner : region) {
    EXPECT_TRUE(corner.x() == 0 || corner.x() == 800);
    EXPECT_TRUE(corner.y() == 0 || corner.y() == 600);
  }
  EXPECT_TRUE(lies_in(region, {800, 600}));
}

TEST(KnownRegion, OfASlantedSetIsSlanted) {
  const ImageRegion region =
      known_region({{100, 100}, {700, 500}, {690, 510}, {90, 110}}, kImager, LensModel::opencv8);
  EXPECT_TRUE(lies_in(region, {400, 300}));
  EXPECT_FALSE(lies_in(region, {700, 100}));
  EXPECT_LT(share_of_image(region, kImager), 0.3);
}

/// As mrcal's may be, in either direction round.
TEST(KnownRegion, MayBeBent) {
  ImageRegion region{{0, 0}, {400, 0}, {200, 100}, {400, 400}, {0, 400}};
  for (int round = 0; round < 2; ++round) {
    EXPECT_TRUE(lies_in(region, {199, 100}));
    EXPECT_TRUE(lies_in(region, {200, 100}));
    EXPECT_TRUE(lies_in(region, {300, 50}));
    EXPECT_FALSE(lies_in(region, {201, 100}));
    EXPECT_FALSE(lies_in(region, {300, 100}));
    EXPECT_TRUE(lies_in(region, {300, 300}));
    EXPECT_FALSE(lies_in(region, {-1, 100}));
    EXPECT_FALSE(lies_in(region, {-1, 400}));
    EXPECT_NEAR(share_of_image(region, kImager), 120000.0 / (800 * 600), 1e-12);
    std::reverse(region.begin(), region.end());
  }
}

TEST(KnownRegion, NeedsThreeCornersThatAreNotOnALine) {
  EXPECT_TRUE(known_region({}, kImager, LensModel::opencv8).empty());
  EXPECT_TRUE(known_region({{1, 1}, {2, 2}, {3, 3}, {9, 9}}, kImager, LensModel::opencv8).empty());
  EXPECT_FALSE(lies_in({}, {1, 1}));
  EXPECT_EQ(share_of_image({}, kImager), 0);
}

}  // namespace
}  // namespace vlp
