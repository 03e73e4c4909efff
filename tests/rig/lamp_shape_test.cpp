// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace vlp {
namespace {

TEST(ComputeLampOutlinePoints, ContainsCornersOfRotatedRectangle) {
  const LampShape shape{ShapeKind::rectangle, Eigen::Vector2d(1.2, 0.4), std::numbers::pi / 2};
  const auto outline_m = compute_lamp_outline_points(shape, {1, 2, 3}, 8);
  ASSERT_EQ(outline_m.size(), 8U);
  EXPECT_LT((outline_m[1] - Eigen::Vector3d(0.8, 2.6, 3)).norm(), 1e-12);
  EXPECT_LT((outline_m[3] - Eigen::Vector3d(0.8, 1.4, 3)).norm(), 1e-12);
  EXPECT_LT((outline_m[5] - Eigen::Vector3d(1.2, 1.4, 3)).norm(), 1e-12);
  EXPECT_LT((outline_m[7] - Eigen::Vector3d(1.2, 2.6, 3)).norm(), 1e-12);
  EXPECT_LT((outline_m[0] - Eigen::Vector3d(1, 2.6, 3)).norm(), 1e-12) << "middle of a side";
}

TEST(ComputeLampOutlinePoints, ReturnsCircleOfDiscRadiusForDisc) {
  const Eigen::Vector3d center_m(1, 2, 3);
  const auto outline_m = compute_lamp_outline_points(make_disc_lamp_shape(0.2), center_m);
  ASSERT_EQ(outline_m.size(), 16U);
  for (const Eigen::Vector3d& point_m : outline_m) {
    EXPECT_NEAR((point_m - center_m).norm(), 0.1, 1e-12);
    EXPECT_EQ(point_m.z(), 3);
  }
}

TEST(ComputeLampOutlinePoints, IsEmptyWithoutSize) {
  EXPECT_TRUE(compute_lamp_outline_points({}, {1, 2, 3}).empty());
}

TEST(TransformShapePointToWorld, ScalesRotatesAndTranslatesPoint) {
  const LampShape shape{ShapeKind::rectangle, Eigen::Vector2d(1.2, 0.4), std::numbers::pi / 2};
  const Eigen::Vector3d point_m = transform_shape_point_to_world(shape, {1, 2, 3}, {0.5, -1});
  EXPECT_LT((point_m - Eigen::Vector3d(1.2, 2.3, 3)).norm(), 1e-12);
}

}  // namespace
}  // namespace vlp
