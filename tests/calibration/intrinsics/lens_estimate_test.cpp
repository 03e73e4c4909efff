// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_estimate.h"

#include <gmock/gmock.h>

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "calibration/intrinsics/board_print.h"
#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/wide_views.h"
#include "camera/spline_grid.h"
#include "geometry/angles.h"
#include "geometry/polygon.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

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
  const auto difference = compare_projections(synthetic_lens(), result.solution.fitted_lens(),
                                              {800, 600}, [](const auto&) { return 1.0; });
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

TEST(EstimateLens, RequiresSixViewsForChoiceOfLensModel) {
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

TEST(EstimateLens, AddsBoardPrintErrorToUncertainty) {
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
  const auto effect =
      estimate_aspect_effect(exact.solution, input.board.print_sd, exact.report.region);
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

TEST(EstimateLens, RecommendsSplineGridThatReachesAllBoards) {
  const auto narrow =
      lens_model_from_name("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=11_Ny=11_fov_x_deg=100");
  ASSERT_TRUE(narrow);
  const LensEstimate result = estimate_lens(make_wide_views(20, 180, *narrow));
  ASSERT_EQ(result.status, LensStatus::undetermined);
  EXPECT_THAT(result.problem, AllOf(HasSubstr("20 views with the board: the control points of "),
                                    HasSubstr("fov_x_deg=100 extend to "),
                                    HasSubstr(": use --lens LENSMODEL_SPLI")));
}

TEST(EstimateLens, RecommendsFisheyeForBoardsFarOffAxis) {
  const LensEstimate result = estimate_lens(make_wide_views(24, 85, LensModel::opencv8));
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_EQ(result.better_model, LensModel::fisheye);
  EXPECT_THAT(result.warnings, testing::Contains(AllOf(HasSubstr("the board is visible up to 8"),
                                                       HasSubstr("use --lens OPENCV_FISHEYE"))));
}

TEST(EstimateLens, ChoosesFisheyeForBoardsBeyond90DegreesOffAxis) {
  LensViews input = make_wide_views(16, 180, LensModel::opencv8);
  input.choose_lens_model = true;
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  ASSERT_TRUE(result.choice);
  EXPECT_EQ(result.choice->model, LensModel::fisheye);
  EXPECT_EQ(result.solution.problem.lens_model, LensModel::fisheye);
  EXPECT_THAT(result.warnings, IsEmpty());
}

TEST(SelectBoardWarp, TurnsWarpOffForSquareChessboardOnly) {
  Board chessboard;
  chessboard.kind = BoardKind::chessboard;
  chessboard.cols = chessboard.rows = 7;
  EXPECT_EQ(select_board_warp(chessboard, WarpChoice::automatic), WarpChoice::off);
  EXPECT_EQ(select_board_warp(chessboard, WarpChoice::off), WarpChoice::off);
  EXPECT_THROW(select_board_warp(chessboard, WarpChoice::on), std::invalid_argument);
  chessboard.rows = 6;
  Board tags = synthetic_board(false);
  tags.rows = tags.cols;
  for (const Board& board : {chessboard, tags}) {
    for (const WarpChoice warp : {WarpChoice::automatic, WarpChoice::on, WarpChoice::off}) {
      EXPECT_EQ(select_board_warp(board, warp), warp);
    }
  }
}

/// Returns the input of the solve of an estimate without held-out views.
IntrinsicsInput make_solver_input(const LensEstimate& result, const Board& board) {
  IntrinsicsInput input{
      BoardLattice(board), {}, result.views.front().imager_px, result.solution.problem.lens_model};
  for (const BoardView& view : result.views)
    input.views.push_back(input.lattice.list_corners(view.detection));
  return input;
}

TEST(EstimateLens, ProblemStatesThatViewsAreParallel) {
  LensViews input = make_views(1, 0);
  input.views.resize(8, input.views[0]);
  const LensEstimate result = estimate_lens(input);
  EXPECT_EQ(result.status, LensStatus::undetermined);
  EXPECT_THAT(result.problem, testing::StartsWith("8 views with the board: all views show the "
                                                  "board at the same angle"));
}

TEST(EstimateLens, CovarianceAssumesOneErrorPerTagAndAddsRegularizationBias) {
  LensViews input = make_views(7);
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  ASSERT_TRUE(result.intrinsics_covariance && result.lattice);
  const ProjectionUncertainty uncertainty(result.solution, *result.lattice);
  const Eigen::VectorXd& bias = uncertainty.regularization_bias();
  ASSERT_GT(bias.norm(), 0);
  Eigen::MatrixXd expected = uncertainty.intrinsics_covariance() + bias * bias.transpose();
  if (const auto& model = result.model_uncertainty) expected += model->intrinsics_covariance;
  const Eigen::VectorXd inverse = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_THAT(
      (inverse.asDiagonal() * (*result.intrinsics_covariance - expected) * inverse.asDiagonal())
          .eval(),
      IsNear(Eigen::MatrixXd::Zero(12, 12).eval(), 1e-9));
  const IntrinsicsInput solver_input = make_solver_input(result, input.board);
  const ViewCoverage coverage = measure_view_coverage(result.solution, solver_input);
  EXPECT_EQ(result.coverage.corners, coverage.corners);
  EXPECT_EQ(result.coverage.covered_fraction, coverage.covered_fraction);
  EXPECT_EQ(result.coverage.tilts_rad, coverage.tilts_rad);
}

/// The limit of the displacement of the edges is 0.4 px.
TEST(EstimateLens, WarnsOfEdgeDisplacementAboveLimitWithDirection) {
  const LensViews exact = make_views(4, 0.02);
  const auto list_warnings = [&](double shift_px) {
    LensViews input = exact;
    for (BoardView& view : input.views) {
      for (TagDetection& tag : view.detection.tags) tag = shrunk(tag, shift_px);
    }
    const LensEstimate result = estimate_lens(input);
    EXPECT_TRUE(result.has_succeeded()) << result.problem;
    return result.warnings;
  };
  EXPECT_THAT(list_warnings(0.38), IsEmpty());
  EXPECT_THAT(list_warnings(-0.38), IsEmpty());
  const auto dark = list_warnings(0.45), light = list_warnings(-0.45);
  ASSERT_THAT(dark, SizeIs(1));
  ASSERT_THAT(light, SizeIs(1));
  EXPECT_THAT(dark[0], HasSubstr("the edges of the tags are 0.45 px towards the dark, more"));
  EXPECT_THAT(light[0], HasSubstr("the edges of the tags are 0.45 px towards the light, more"));
}

/// The spacing is compared with the images before the solve, to 5 %, and with the lens, to 1 %.
TEST(EstimateLens, ReturnsWrongBoardForSpacingThatOnlyLensContradicts) {
  const SyntheticViews synthetic{synthetic_board(true), synthetic_lens()};
  LensViews input{{}, synthetic.board};
  Random random(11);
  for (int i = 0; i < 6; ++i) {
    input.views.push_back(
        {std::to_string(i), synthetic.imager_px, synthetic.random_view(random, 0.02)});
  }
  input.board.tag_spacing = 0.308;
  EXPECT_TRUE(estimate_lens(input).has_succeeded());
  input.board.tag_spacing = 0.325;
  const LensEstimate result = estimate_lens(input);
  EXPECT_EQ(result.status, LensStatus::wrong_board);
  EXPECT_EQ(result.problem, "tag_spacing is 0.325, but the images show gaps of 0.3 tags");
  EXPECT_TRUE(result.solution.has_succeeded());
}

TEST(EstimateLens, ComparesLensModelsOnlyForFiveViewsOrMore) {
  for (const int count : {4, 5}) {
    const LensEstimate result = estimate_lens(make_views(count));
    ASSERT_TRUE(result.has_succeeded()) << result.problem;
    EXPECT_EQ(result.are_models_compared, count == 5);
    EXPECT_TRUE(count == 5 || !result.model_uncertainty);
  }
}

TEST(EstimateLens, RecommendsFisheyeThatFitsClearlyBetterAndAddsModelUncertainty) {
  const LensViews input = make_wide_views(10, 60, LensModel::opencv5);
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_EQ(result.better_model, LensModel::fisheye);
  const IntrinsicsInput solver_input = make_solver_input(result, input.board);
  EXPECT_THAT(result.warnings,
              ElementsAre(AllOf(StartsWith("the board is visible up to 60 degrees off axis; "
                                           "OPENCV_FISHEYE fits with 0.0"),
                                EndsWith("use --lens OPENCV_FISHEYE"))));
  // Another model folds nearer to the center.
  const CalibrationReport report = make_lens_report(
      result.solution, solver_input,
      ProjectionUncertainty::compare_corners_and_tags(result.solution, solver_input.lattice),
      result.report.region);
  EXPECT_LT(report.region_fraction,
            make_lens_report(result.solution, solver_input).region_fraction);
  ASSERT_TRUE(result.model_uncertainty);
  const ModelUncertainty& model = *result.model_uncertainty;
  EXPECT_EQ(model.model, LensModel::fisheye);
  EXPECT_GT(model.worst_px, report.uncertainty_worst_px);
  EXPECT_NEAR(result.report.uncertainty_worst_px,
              std::hypot(report.uncertainty_worst_px, model.worst_px), 1e-9);
  EXPECT_NEAR(result.report.uncertainty_mean_px,
              std::hypot(report.uncertainty_mean_px, model.mean_px), 1e-9);
}

TEST(EstimateLens, RecommendsFisheyeIfNoLensOfModelFits) {
  const LensEstimate result = estimate_lens(make_wide_views(7, 80, LensModel::opencv5));
  EXPECT_EQ(result.status, LensStatus::undetermined);
  EXPECT_EQ(result.problem,
            "7 views with the board: no lens of LENSMODEL_OPENCV5 fits, but OPENCV_FISHEYE fits "
            "with 0.05 px: use --lens OPENCV_FISHEYE");
}

/// Returns a view of a board beyond the control points of a grid of 130 degrees.
BoardView make_far_view() {
  const SyntheticViews synthetic = wide_views(false);
  Random random(2);
  const Eigen::Matrix3d towards =
      Eigen::AngleAxisd(rad_from_deg(78), Eigen::Vector3d::UnitY()).toRotationMatrix();
  return {"far.png", synthetic.imager_px,
          synthetic.view(towards, 1.2 * towards.col(2), random, kViewNoise_px)};
}

/// A board beyond the control points has no pose.
TEST(EstimateLens, WarnsOfViewBeyondControlPointsOfSplinedLens) {
  LensViews input = make_wide_views(10, 55, splined_lens_model({3, 10, 10, 130}));
  input.views.push_back(make_far_view());
  ASSERT_GT(input.views.back().detection.tags.size(), 20U);
  const LensEstimate result = estimate_lens(input);
  ASSERT_TRUE(result.has_succeeded()) << result.problem;
  EXPECT_THAT(result.warnings,
              ElementsAre("far.png: dropped, as the board is where "
                          "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=10_Ny=10_fov_x_deg=130 has "
                          "no control points; use a larger fov_x_deg or Ny"));
  EXPECT_THAT(result.images, SizeIs(11));
  EXPECT_FALSE(result.intrinsics_covariance);
}

}  // namespace
}  // namespace vlp
