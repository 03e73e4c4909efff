// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_estimate.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibration/intrinsics/board_print.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/wide_views.h"
#include "geometry/angles.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr double kViewNoise_px = 0.05;

/// Returns views named 1.png, 2.png, ... of a plain board through synthetic_lens().
LensViews make_views(int count, double noise_px = kViewNoise_px) {
  const SyntheticViews synthetic{synthetic_board(false), synthetic_lens()};
  LensViews input{{}, synthetic.board};
  Random random(11);
  for (int i = 1; i <= count; ++i) {
    input.views.push_back(
        {std::to_string(i) + ".png", synthetic.imager_px, synthetic.random_view(random, noise_px)});
  }
  return input;
}

TEST(EstimateLens, ReturnsLensWithUncertaintyAndWithoutWarnings) {
  const LensEstimate result = estimate_lens(make_views(20));
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_EQ(result.status, LensStatus::ok);
  EXPECT_THAT(result.problem, IsEmpty());
  EXPECT_THAT(result.warnings, IsEmpty());
  EXPECT_THAT(result.details, IsEmpty());
  EXPECT_THAT(result.inconsistent_views, IsEmpty());
  EXPECT_EQ(result.gamma, 1);
  EXPECT_THAT(result.views, SizeIs(20));
  ASSERT_THAT(result.images, SizeIs(20));
  EXPECT_EQ(result.images.front(), "1.png");
  EXPECT_EQ(result.images.back(), "20.png");
  EXPECT_NEAR(result.solution.rms_px, kViewNoise_px, 0.1 * kViewNoise_px);
  EXPECT_EQ(result.held_out.views, 0);
  EXPECT_FALSE(result.choice || result.better_model || result.print_px || result.sharpness);
  ASSERT_TRUE(result.lattice);
  const auto difference = compute_projection_difference(
      synthetic_lens(), result.solution.fitted_lens(), {800, 600}, [](const auto&) { return 1.0; });
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->rms_px, 3 * result.report.expected_rms_px);
  ASSERT_TRUE(result.intrinsics_covariance);
  ASSERT_EQ(result.intrinsics_covariance->rows(), 12);
  const Lens found = result.solution.fitted_lens();
  for (int axis = 0; axis < 2; ++axis) {
    const auto sd_px = [&](int k) { return std::sqrt((*result.intrinsics_covariance)(k, k)); };
    EXPECT_NEAR(found.focal_px()[axis], synthetic_lens().focal_px()[axis], 4 * sd_px(axis));
    EXPECT_NEAR(found.principal_point_px()[axis], synthetic_lens().principal_point_px()[axis],
                4 * sd_px(2 + axis));
  }
}

TEST(EstimateLens, HoldsOutEveryThirdView) {
  LensViews input = make_views(18);
  input.held_out = 3;
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_THAT(result.images,
              ElementsAre("1.png", "2.png", "4.png", "5.png", "7.png", "8.png", "10.png", "11.png",
                          "13.png", "14.png", "16.png", "17.png"));
  EXPECT_EQ(result.solution.views.size(), 12U);
  EXPECT_EQ(result.held_out.views, 6);
  int corners = 0;
  for (std::size_t i = 2; i < 18; i += 3) {
    corners += 4 * static_cast<int>(input.views[i].detection.tags.size());
  }
  EXPECT_NEAR(result.held_out.corners, corners, 8);
  EXPECT_NEAR(result.held_out.rms_px, kViewNoise_px, 0.2 * kViewNoise_px);
  EXPECT_THAT(result.warnings, IsEmpty());
  input.views.resize(3);
  const LensEstimate few = estimate_lens(input);
  EXPECT_EQ(few.status, LensStatus::too_few_views);
  EXPECT_THAT(few.problem, HasSubstr("2 views with the board: "));
}

TEST(EstimateLens, ReturnsTooFewViewsForChoiceOfModelBelowSix) {
  LensViews input = make_views(5);
  input.choose_lens_model = true;
  const LensEstimate result = estimate_lens(input);
  EXPECT_EQ(result.status, LensStatus::too_few_views);
  EXPECT_THAT(result.problem, AllOf(HasSubstr("5 views of the board do not determine"),
                                    HasSubstr("which needs 6; add views")));
}

TEST(EstimateLens, ReturnsWrongBoardForOtherSpacing) {
  LensViews input = make_views(8);
  input.board.tag_spacing = 0.5;
  const LensEstimate result = estimate_lens(input);
  EXPECT_EQ(result.status, LensStatus::wrong_board);
  EXPECT_THAT(result.problem, HasSubstr("tag_spacing"));
}

/// A view with tags at positions that no pose of the board explains.
TEST(EstimateLens, WarnsOfDroppedViewWithItsImage) {
  LensViews input = make_views(12);
  Random random(3);
  for (TagDetection& tag : input.views[4].detection.tags) {
    const Eigen::Vector2d shift_px(random.uniform(-30, 30), random.uniform(-30, 30));
    for (Eigen::Vector2d& corner : tag.corners_px) corner += shift_px;
  }
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  ASSERT_THAT(result.warnings, SizeIs(1));
  EXPECT_THAT(result.warnings[0], HasSubstr("5.png: fits no pose that goes with the other views"));
  EXPECT_EQ(result.solution.views.size(), 11U);
}

/// Three of 30 views are of another camera, whose focal length is shorter by 2 %.
TEST(EstimateLens, WarnsOfViewsInconsistentWithLensOfOthers) {
  constexpr double noise_px = 0.02;
  LensViews input = make_views(30, noise_px);
  const std::array parameters{509.0,  510.0,   407.0,  304.0, -0.25, 0.08,
                              0.0002, -0.0001, -0.012, 0.01,  0.002, 0.0001};
  const SyntheticViews other{input.board, Lens(LensModel::opencv8, parameters)};
  Random random(12);
  for (const std::size_t i : {3U, 10U, 20U}) {
    input.views[i].detection = other.random_view(random, noise_px);
  }
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_THAT(result.inconsistent_views,
              HasSubstr("3 board images do not fit the other 27: 4.png, 11.png, 21.png"));
  EXPECT_THAT(result.warnings, testing::Contains(result.inconsistent_views));
}

TEST(EstimateLens, AddsErrorOfPrintToUncertainty) {
  LensViews input = make_views(20);
  const LensEstimate exact = estimate_lens(input);
  input.board.print_sd = 0.002;
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(exact.has_succeeded() && result.has_succeeded());
  ASSERT_TRUE(result.print_px);
  EXPECT_GT(*result.print_px, 0.02);
  EXPECT_GT(result.report.uncertainty_mean_px, exact.report.uncertainty_mean_px);
  EXPECT_GT(result.report.uncertainty_worst_px, exact.report.uncertainty_worst_px);
  ASSERT_TRUE(exact.intrinsics_covariance && result.intrinsics_covariance);
  const auto effect = compute_board_aspect_error_effect_on_lens(
      exact.solution, input.board.print_sd, exact.report.region);
  ASSERT_TRUE(effect);
  const Eigen::MatrixXd added = effect->intrinsics * effect->intrinsics.transpose();
  EXPECT_THAT((*result.intrinsics_covariance - *exact.intrinsics_covariance).eval(),
              IsNear(added, 1e-6 * added.norm()));
}

/// Returns views of a 190-degree lens up to `reach_deg` off the axis.
LensViews make_wide_views(int count, double reach_deg, LensModel model) {
  const SyntheticViews synthetic = wide_views(false);
  LensViews input{{}, synthetic.board, model};
  const BoardLattice lattice(synthetic.board);
  Random random(5);
  WideBoards boards;
  boards.reach_rad = rad_from_deg(reach_deg);
  while (std::ssize(input.views) < count) {
    BoardDetection seen = wide_view(synthetic, random, kViewNoise_px, boards);
    if (!has_enough_tags(seen, lattice)) continue;
    input.views.push_back({std::to_string(input.views.size()), synthetic.imager_px, seen});
  }
  return input;
}

TEST(EstimateLens, NamesSplineGridThatReachesAllBoards) {
  const auto narrow =
      lens_model_from_name("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=11_Ny=11_fov_x_deg=100");
  ASSERT_TRUE(narrow);
  const LensEstimate result = estimate_lens(make_wide_views(20, 180, *narrow));
  ASSERT_EQ(result.status, LensStatus::undetermined);
  EXPECT_THAT(result.problem, AllOf(HasSubstr("20 views with the board: the control points of "),
                                    HasSubstr("fov_x_deg=100 extend to "),
                                    HasSubstr(": use --lens LENSMODEL_SPLI")));
}

TEST(EstimateLens, KeepsOpencvModelForBoardsNearAxisOfWideLens) {
  LensViews input = make_wide_views(14, 40, LensModel::opencv8);
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_FALSE(result.better_model);
  EXPECT_THAT(result.warnings, IsEmpty());
}

TEST(EstimateLens, RecommendsFisheyeForBoardsFarOffAxis) {
  const LensEstimate result = estimate_lens(make_wide_views(24, 85, LensModel::opencv8));
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_EQ(result.better_model, LensModel::fisheye);
  EXPECT_THAT(result.warnings, testing::Contains(AllOf(HasSubstr("the board is visible up to 8"),
                                                       HasSubstr("use --lens OPENCV_FISHEYE"))));
}

TEST(EstimateLens, ChoosesFisheyeForBoardsBeyondRightAngle) {
  LensViews input = make_wide_views(16, 180, LensModel::opencv8);
  input.choose_lens_model = true;
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  ASSERT_TRUE(result.choice);
  EXPECT_EQ(result.choice->model, LensModel::fisheye);
  EXPECT_EQ(result.solution.problem.lens_model, LensModel::fisheye);
  EXPECT_THAT(result.warnings, IsEmpty());
}

TEST(SelectBoardWarpModel, TurnsWarpOffForSquareChessboardOnly) {
  Board chessboard;
  chessboard.kind = BoardKind::chessboard;
  chessboard.cols = chessboard.rows = 7;
  EXPECT_EQ(select_board_warp_model(chessboard, WarpChoice::automatic), WarpChoice::off);
  EXPECT_EQ(select_board_warp_model(chessboard, WarpChoice::off), WarpChoice::off);
  EXPECT_THROW(select_board_warp_model(chessboard, WarpChoice::on), std::invalid_argument);
  chessboard.rows = 6;
  Board tags = synthetic_board(false);
  tags.rows = tags.cols;
  for (const Board& board : {chessboard, tags}) {
    for (const WarpChoice warp : {WarpChoice::automatic, WarpChoice::on, WarpChoice::off}) {
      EXPECT_EQ(select_board_warp_model(board, warp), warp);
    }
  }
}

}  // namespace
}  // namespace vlp
