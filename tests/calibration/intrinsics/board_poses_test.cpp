// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_poses.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/wide_views.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the corners of 6 x 4 points, 30 mm apart, at a pose of the board.
std::vector<BoardLattice::Corner> project_board(const Lens& lens, const BoardPose& pose) {
  std::vector<BoardLattice::Corner> corners;
  for (int row = 0; row < 4; ++row) {
    for (int col = 0; col < 6; ++col) {
      const Eigen::Vector3d in_board_m(0.03 * col, 0.03 * row, 0);
      const auto pixel =
          lens.project_point(rotation_from_vector(pose.rotation) * in_board_m + pose.translation_m);
      if (pixel) corners.push_back({in_board_m, *pixel, 0, corners.size()});
    }
  }
  return corners;
}

double compute_weighted_squares(const std::vector<BoardLattice::Corner>& corners, const Lens& lens,
                                const BoardPose& pose) {
  double squares = 0;
  for (const auto& corner : corners) {
    const Eigen::Vector2d pixel =
        lens.project_point(rotation_from_vector(pose.rotation) * corner.in_board_m +
                           pose.translation_m)
            .value();
    squares += std::pow(corner.weight, 2) * (pixel - corner.pixel).squaredNorm();
  }
  return squares;
}

TEST(EstimateViewPose, ReturnsExactPoseForExactCorners) {
  for (const BoardPose& truth : {BoardPose{{0.5, -0.3, 0.8}, {-0.05, 0.02, 0.4}},
                                 {{-0.6, 0.1, -2}, {0.05, 0.06, 0.5}},
                                 {{0.1, 0.7, 0.2}, {-0.1, -0.1, 0.6}}}) {
    const auto corners = project_board(synthetic_lens(), truth);
    ASSERT_EQ(corners.size(), 24U);
    const auto pose = estimate_view_pose(corners, synthetic_lens());
    ASSERT_TRUE(pose);
    EXPECT_THAT(pose->camera_from_board.rotation, IsNear(truth.rotation, 1e-7));
    EXPECT_THAT(pose->camera_from_board.translation_m, IsNear(truth.translation_m, 1e-8));
    EXPECT_LT(pose->rms_px, 1e-6);
  }
}

TEST(EstimateViewPose, ReturnsExactPoseOfBoardBesideFisheyeLens) {
  const Eigen::Matrix3d towards =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      Eigen::AngleAxisd(1.4, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd rotation(towards);
  const BoardPose truth{rotation.angle() * rotation.axis(),
                        towards * Eigen::Vector3d(-0.07, -0.04, 0.3)};
  const auto corners = project_board(wide_lens(), truth);
  ASSERT_EQ(corners.size(), 24U);
  const auto pose = estimate_view_pose(corners, wide_lens());
  ASSERT_TRUE(pose);
  EXPECT_THAT(pose->camera_from_board.rotation, IsNear(truth.rotation, 1e-7));
  EXPECT_THAT(pose->camera_from_board.translation_m, IsNear(truth.translation_m, 1e-8));
}

TEST(EstimateViewPose, MinimizesWeightedSquaresAndReturnsTheirRms) {
  const Lens lens = synthetic_lens();
  auto corners = project_board(lens, {{0.5, -0.3, 0.8}, {-0.05, 0.02, 0.4}});
  ASSERT_EQ(corners.size(), 24U);
  Random random(3);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i].weight = i % 3 == 0 ? 0.1 : 1 + 0.1 * static_cast<double>(i);
    const double v = random.normal(), u = random.normal();
    corners[i].pixel += Eigen::Vector2d(u, v) / corners[i].weight;
  }
  const auto pose = estimate_view_pose(corners, lens);
  ASSERT_TRUE(pose);
  const double squares = compute_weighted_squares(corners, lens, pose->camera_from_board);
  EXPECT_NEAR(pose->rms_px, std::sqrt(squares / 48), 1e-9);
  // Steps of each parameter in both directions increase the squares.
  for (int k = 0; k < 6; ++k) {
    for (const double step : {-0.002, 0.002}) {
      BoardPose moved = pose->camera_from_board;
      (k < 3 ? moved.rotation[k] : moved.translation_m[k - 3]) += step;
      EXPECT_GT(compute_weighted_squares(corners, lens, moved), squares) << k;
    }
  }
}

TEST(EstimateViewPose, ReturnsNulloptForFewerThanFourCornersWithRay) {
  const Lens lens = wide_lens();
  const auto all = project_board(lens, {{0.5, -0.3, 0.8}, {-0.05, 0.02, 0.4}});
  ASSERT_EQ(all.size(), 24U);
  std::vector<BoardLattice::Corner> corners{all[0], all[4], all[15], all[20]};
  EXPECT_TRUE(estimate_view_pose(corners, lens));
  const std::vector<BoardLattice::Corner> three(corners.begin(), corners.end() - 1);
  EXPECT_FALSE(estimate_view_pose(three, lens));
  EXPECT_FALSE(estimate_view_pose({}, lens));
  ASSERT_FALSE(lens.unproject_pixel({1e4, 1e4}));
  corners[1].pixel = {1e4, 1e4};
  EXPECT_FALSE(estimate_view_pose(corners, lens));
}

TEST(EstimateBoardPoses, ReturnsInfiniteRmsForViewWithoutPose) {
  const BoardPose first{{0.5, -0.3, 0.8}, {-0.05, 0.02, 0.4}},
      last{{-0.6, 0.1, -2}, {0.05, 0.06, 0.5}};
  IntrinsicsInput input{BoardLattice(synthetic_board(false)), {}, {800, 600}, LensModel::opencv8};
  input.views = {project_board(synthetic_lens(), first), {}, project_board(synthetic_lens(), last)};
  const InitialPoses found = estimate_board_poses(input, synthetic_lens());
  ASSERT_EQ(found.poses.size(), 3U);
  ASSERT_EQ(found.rms_px.size(), 3U);
  EXPECT_THAT(found.poses[0].translation_m, IsNear(first.translation_m, 1e-8));
  EXPECT_THAT(found.poses[2].translation_m, IsNear(last.translation_m, 1e-8));
  EXPECT_LT(found.rms_px[0], 1e-6);
  EXPECT_EQ(found.rms_px[1], std::numeric_limits<double>::infinity());
  EXPECT_LT(found.rms_px[2], 1e-6);
}

/// Returns views through a stereographic lens of the given focal length.
IntrinsicsInput make_stereographic_views(double focal_px, int count) {
  const SyntheticViews views{
      synthetic_board(false),
      Lens(LensModel::stereographic, std::array{focal_px, focal_px, 399.5, 299.5})};
  Random random(8);
  return views.input(count, random, 0.01);
}

TEST(RankInitialFocalLengths, RanksTrueFocalLengthFirst) {
  // The width of the image times powers of sqrt(2).
  std::vector<double> series;
  for (int k = -5; k <= 6; ++k) series.push_back(800 * std::pow(std::sqrt(2.0), k));
  for (const double focal_px : {200.0, 400.0, 800 / std::sqrt(2.0)}) {
    std::vector<double> ranked = rank_initial_focal_lengths(make_stereographic_views(focal_px, 5));
    ASSERT_EQ(ranked.size(), 12U);
    EXPECT_NEAR(ranked[0], focal_px, 1e-9);
    std::sort(ranked.begin(), ranked.end());
    for (std::size_t k = 0; k < series.size(); ++k) EXPECT_NEAR(ranked[k], series[k], 1e-9);
  }
}

}  // namespace
}  // namespace vlp
