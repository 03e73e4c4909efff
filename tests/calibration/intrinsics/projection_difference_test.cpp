// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/edge_bias.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/view_pose.h"

namespace vlp {
namespace {

double even(const Eigen::Vector2d&) { return 1; }

TEST(ProjectionDifference, OfALensFromItselfIsNone) {
  const Lens lens = synthetic_lens();
  EXPECT_LT(projection_difference(lens, lens, {800, 600}, even)->worst_px, 1e-6);
}

// A shift of the centre is a turn of the camera but for what grows with the square of the angle.
TEST(ProjectionDifference, DoesNotCountATurnOfTheCamera) {
  const std::array near{3000.0, 3000.0, 400.0, 300.0}, shifted{3000.0, 3000.0, 403.0, 300.0};
  const auto difference = projection_difference(
      Lens(LensModel::pinhole, near), Lens(LensModel::pinhole, shifted), {800, 600}, even);
  EXPECT_LT(difference->worst_px, 0.1);
}

TEST(ProjectionDifference, CountsAnotherFocalLength) {
  const std::array one{500.0, 500.0, 399.5, 299.5}, other{501.0, 501.0, 399.5, 299.5};
  const auto difference = projection_difference(Lens(LensModel::pinhole, one),
                                                Lens(LensModel::pinhole, other), {800, 600}, even);
  EXPECT_NEAR(difference->worst_px, 500.0 / 500, 0.01);  // the corner, 500 px from the centre
}

TEST(EdgeBias, IsZeroWhereLinesStayStraightAndOutwardsWithBarrelDistortion) {
  const BoardLattice lattice(synthetic_board(false));
  SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(2);
  const auto corners = lattice.corners(views.random_view(random, 0));
  const auto pose = view_pose(corners, views.lens);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose->rms_px, 1e-3);
  const std::array straight{520.0, 521.0, 402.0, 297.0};
  const Lens pinhole(LensModel::pinhole, straight);
  for (const auto& bias : edge_bias_px(corners, pose->camera_from_board, pinhole)) {
    EXPECT_LT(bias.norm(), 1e-9);
  }
  const auto bent = edge_bias_px(corners, pose->camera_from_board, views.lens);
  double outwards = 0, most = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d away = corners[i].pixel - views.lens.center_px();
    outwards += bent[i].dot(away.normalized()) / static_cast<double>(corners.size());
    most = std::max(most, bent[i].norm());
  }
  EXPECT_GT(outwards, 0.005);
  EXPECT_LT(most, 1);
}

}  // namespace
}  // namespace vlp
