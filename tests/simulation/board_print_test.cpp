// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/board_print.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/random.h"

namespace vlp {
namespace {

const Eigen::Vector2d kFieldSize_m(0.22, 0.18);  // 6 x 5 tags of 20 mm, 20 mm apart

SceneBoard make_warped_board() {
  const Board pattern{"tag36h11", 6, 5, 0.02, 1.0, 1, false, 0, {false, BoardCorner::bottom_left}};
  return {pattern, 0.01, {0.002, -0.003}, 1, 0, 0};
}

/// Ray from a random origin in front of the board to a point.
struct RayToPoint {
  RayToPoint(const Eigen::Vector3d& point_m, Random& random)
      : origin_m(random.uniform(-0.3, 0.5), random.uniform(-0.3, 0.5), random.uniform(-0.6, -0.1)),
        direction(random.uniform(0.5, 3) * (point_m - origin_m)) {}

  Eigen::Vector3d origin_m, direction;
};

TEST(BoardPattern, RayIntersectsWarpedBoardAtTargetPoint) {
  const SceneBoard board = make_warped_board();
  const BoardPattern pattern(board);
  const BoardWarp warp(board);
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    // A quarter of the points are beside the paper, where the deflection is constant.
    const double reach = i % 4 == 0 ? 0.7 : 0.0;
    const Eigen::Vector2d at_m(random.uniform(-reach, 1 + reach) * kFieldSize_m.x(),
                               random.uniform(-reach, 1 + reach) * kFieldSize_m.y());
    const RayToPoint ray(Eigen::Vector3d(at_m.x(), at_m.y(), warp.compute_deflection(at_m).depth_m),
                         random);
    const Eigen::Vector2d met_m = pattern.intersect(ray.origin_m, ray.direction);
    EXPECT_LT((met_m - at_m).norm(), reach > 0 ? 1e-8 : 1e-14) << at_m.transpose();
  }
}

TEST(BoardPattern, RayAwayFromBoardHasNoIntersection) {
  const BoardPattern pattern(make_warped_board());
  EXPECT_FALSE(pattern.intersect({0.1, 0.1, -0.5}, {0.1, 0.05, -1}).allFinite());
}

TEST(BoardWarp, DeflectionIsGivenWarpInMiddleAndZeroAtCorners) {
  const BoardWarp warp(make_warped_board());
  EXPECT_NEAR(warp.compute_deflection(kFieldSize_m / 2).depth_m, -0.001, 1e-15);
  EXPECT_NEAR(warp.compute_deflection({0, 0}).depth_m, 0, 1e-15);
  const auto [depth_m, slope] = warp.compute_deflection({0.03, 0.15});
  constexpr double step_m = 1e-6;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d moved_m =
        Eigen::Vector2d(0.03, 0.15) + step_m * Eigen::Vector2d::Unit(axis);
    EXPECT_NEAR((warp.compute_deflection(moved_m).depth_m - depth_m) / step_m, slope[axis], 1e-6);
  }
}

}  // namespace
}  // namespace vlp
