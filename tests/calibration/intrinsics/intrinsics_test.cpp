// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

ProjectionDifference difference(const IntrinsicsSolution& solution, const SyntheticViews& views) {
  return compute_projection_difference(views.lens, solution.fitted_lens(), views.imager_px, even)
      .value();
}

class SolveIntrinsics : public testing::TestWithParam<bool> {
 protected:
  SyntheticViews views_{synthetic_board(GetParam()), synthetic_lens()};
  Random random_{7};
};

// The regularization causes errors up to 0.003 to 0.03 px, in image corners that no view covers.
TEST_P(SolveIntrinsics, LensAndBoardWarpMatchTruthForExactCorners) {
  views_.warp_m = {0.0004, -0.0003};
  const IntrinsicsInput input = views_.input(20, random_, 0);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded()) << describe_intrinsics_status(solution.status);
  EXPECT_EQ(solution.views.size(), 20U);
  EXPECT_LT(solution.rms_px, 0.001);
  EXPECT_LT(difference(solution, views_).mean_px, 0.002);
  EXPECT_LT(difference(solution, views_).worst_px, 0.05);
  const Eigen::Vector2d warp_m =
      solution.problem.warp_m.cwiseProduct(input.lattice.board_to_part_warp_ratio());
  EXPECT_LT((warp_m - views_.warp_m).norm(), 2e-6);
}

TEST_P(SolveIntrinsics, RecoversFocalLengthsFrom250To4000Pixels) {
  for (const double focal_px : {250.0, 600.0, 1500.0, 4000.0}) {
    const std::array parameters{focal_px, focal_px, 390.0, 310.0};
    SyntheticViews views{synthetic_board(GetParam()), Lens(LensModel::pinhole, parameters)};
    const IntrinsicsSolution solution = solve_intrinsics(views.input(15, random_, 0.05));
    ASSERT_TRUE(solution.has_succeeded())
        << focal_px << describe_intrinsics_status(solution.status);
    EXPECT_NEAR(solution.problem.intrinsics[0] / focal_px, 1, 0.01) << focal_px;
    EXPECT_NEAR(solution.rms_px, 0.05, 0.01) << focal_px;
  }
}

TEST_P(SolveIntrinsics, ReturnsIdenticalIntrinsicsAndRmsWhenRepeated) {
  const IntrinsicsInput input = views_.input(10, random_, 0.1);
  const IntrinsicsSolution one = solve_intrinsics(input), two = solve_intrinsics(input);
  ASSERT_TRUE(one.has_succeeded());
  EXPECT_EQ(one.problem.intrinsics, two.problem.intrinsics);
  EXPECT_EQ(one.rms_px, two.rms_px);
}

TEST_P(SolveIntrinsics, DropsViewWithDistortedCorners) {
  IntrinsicsInput input = views_.input(12, random_, 0.05);
  auto& bad = input.views[4];
  for (auto& corner : bad) corner.pixel.x() += 60 * std::sin(corner.pixel.y() / 15);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.dropped_views.size(), 1U);
  EXPECT_EQ(solution.dropped_views[0].view, 4U);
  EXPECT_GT(solution.dropped_views[0].rms_px, 3);
  EXPECT_EQ(solution.views.size(), 11U);
  EXPECT_LT(difference(solution, views_).mean_px, 0.15);
}

TEST_P(SolveIntrinsics, RejectsDisplacedCornersAsOutliers) {
  IntrinsicsInput input = views_.input(15, random_, 0.05);
  for (std::size_t i = 0; i < 10; ++i) input.views[i][3 * i].pixel.y() += 1.5;
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_GE(solution.outliers, 10);
  EXPECT_LT(solution.outliers, 40);
  EXPECT_NEAR(solution.rms_px, 0.05, 0.006);
}

TEST_P(SolveIntrinsics, ReturnsTooFewViewsStatusForTwoViews) {
  const auto solution = solve_intrinsics(views_.input(2, random_, 0.05));
  EXPECT_EQ(solution.status, IntrinsicsStatus::too_few_views);
}

TEST_P(SolveIntrinsics, ReturnsAllParallelStatusForIdenticalViews) {
  IntrinsicsInput input = views_.input(1, random_, 0);
  input.views.resize(8, input.views[0]);
  EXPECT_EQ(solve_intrinsics(input).status, IntrinsicsStatus::all_parallel);
}

INSTANTIATE_TEST_SUITE_P(Boards, SolveIntrinsics, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

// Boards tilted by up to 60 degrees and partly outside the image, where initial poses may flip.
TEST(SolveIntrinsicsOfPartialBoards, MatchesTrueLensForBoardsTiltedUpTo60Degrees) {
  SyntheticViews views{synthetic_board(false), synthetic_lens()};
  views.tilt_rad = 1.05;
  Random random(11);
  for (int set = 0; set < 15; ++set) {
    const int count = 8 + static_cast<int>(random.index(20));
    const IntrinsicsSolution solution = solve_intrinsics(views.input(count, random, 0.05));
    ASSERT_TRUE(solution.has_succeeded()) << set;
    EXPECT_TRUE(solution.dropped_views.empty()) << set;
    EXPECT_LT(solution.rms_px, 0.06) << set;
    EXPECT_LT(difference(solution, views).mean_px, 0.2) << set;
  }
}

}  // namespace
}  // namespace vlp
