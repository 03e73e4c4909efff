// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "calibration/intrinsics/board_problem.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "camera/spline_grid.h"
#include "support/matchers.h"

namespace vlp {
namespace {

ProjectionDifference difference(const IntrinsicsSolution& solution, const SyntheticViews& views) {
  return compare_projections(views.lens, solution.fitted_lens(), views.imager_px, even).value();
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
  ASSERT_TRUE(solution.has_succeeded()) << describe_status(solution.status);
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
    ASSERT_TRUE(solution.has_succeeded()) << focal_px << describe_status(solution.status);
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

/// Corners in a row of synthetic_board().
constexpr std::size_t kCols = 12;

/// Returns a lens of OPENCV_FISHEYE for 800 x 600 px.
Lens fisheye_for_solves() {
  return {LensModel::fisheye, std::array{290.0, 291.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006}};
}

/// Returns exact views whose edges do not shift.
IntrinsicsInput make_exact_views(int count, const Lens& lens = fisheye_for_solves(),
                                 const Eigen::Vector2d& warp_m = {0, 0}) {
  SyntheticViews views{synthetic_board(false), lens};
  views.warp_m = warp_m;
  Random random(31);
  return make_views_without_edge_shifts(views, count, random, 0);
}

TEST(DescribeIntrinsicsStatus, StatesCause) {
  EXPECT_EQ(describe_status(IntrinsicsStatus::ok), "ok");
  EXPECT_TRUE(
      describe_status(IntrinsicsStatus::too_few_views).starts_with("fewer than three views"));
  EXPECT_TRUE(describe_status(IntrinsicsStatus::all_parallel)
                  .starts_with("all views show the board at the same angle"));
  EXPECT_TRUE(describe_status(IntrinsicsStatus::no_solution).starts_with("no lens fits the views"));
}

/// Views with more than half of the worst residual are dropped first.
TEST(SolveFirstStages, DropsWorstViewFirst) {
  IntrinsicsInput input = make_exact_views(9);
  displace_alternately(input.views[2], 4, kCols);
  displace_alternately(input.views[6], 10, kCols);
  const auto solution = InitialSolutions(input).solve_first_stages(LensModel::fisheye);
  ASSERT_TRUE(solution);
  ASSERT_EQ(solution->dropped_views.size(), 2U);
  EXPECT_EQ(solution->dropped_views[0].view, 6U);
  EXPECT_EQ(solution->dropped_views[1].view, 2U);
  EXPECT_NEAR(solution->dropped_views[1].rms_px, 4, 0.2);
  EXPECT_THAT(solution->views, testing::ElementsAre(0, 1, 3, 4, 5, 7, 8));
}

/// The lens of all views has large errors from views 3 and 5, with which views 1 and 2 have no
/// pose.
TEST(SolveFirstStages, ReinstatesViewsThatFitLensWithoutBadViews) {
  IntrinsicsInput input = make_exact_views(9);
  for (const std::size_t view : {3U, 5U}) {
    for (auto& corner : input.views[view])
      corner.pixel.x() += 120 * std::sin(corner.pixel.y() / 60);
  }
  const auto solution = InitialSolutions(input).solve_first_stages(LensModel::fisheye);
  ASSERT_TRUE(solution);
  EXPECT_THAT(solution->views, testing::ElementsAre(0, 1, 2, 4, 6, 7, 8));
  ASSERT_EQ(solution->dropped_views.size(), 2U);
  EXPECT_EQ(solution->dropped_views[0].view, 3U);
  EXPECT_EQ(solution->dropped_views[1].view, 5U);
  EXPECT_LT(solution->rms_px, 1e-4);
  ASSERT_EQ(solution->problem.points.size(), 7 * 120U);
  for (std::size_t i = 0; i < 7; ++i) {
    for (const auto& corner : input.views[solution->views[i]])
      EXPECT_EQ(solution->problem.points[i * 120 + corner.point].head<2>(), corner.pixel);
  }
}

TEST(SolveIntrinsics, FailsUnlessMoreThanHalfOfViewsHaveCorners) {
  IntrinsicsInput input = make_exact_views(7);
  for (const std::size_t i : {0U, 3U, 5U}) input.views[i].clear();
  const IntrinsicsSolution four = solve_intrinsics(input);
  ASSERT_TRUE(four.has_succeeded());
  EXPECT_THAT(four.views, testing::ElementsAre(1, 2, 4, 6));
  EXPECT_EQ(four.edge_displacements_px.size(), 4U);
  input.views.emplace_back();
  const IntrinsicsSolution half = solve_intrinsics(input);
  EXPECT_EQ(half.status, IntrinsicsStatus::no_solution);
  EXPECT_EQ(half.rms_px, 0);
  EXPECT_EQ(half.corners, 0);
  EXPECT_EQ(half.outliers, 0);
  EXPECT_TRUE(half.views.empty() && half.dropped_views.empty());
}

/// Returns exact views of boards whose normals lie within `tilt_rad` of each other.
IntrinsicsInput make_tilted_views(double tilt_rad) {
  const SyntheticViews views{synthetic_board(false), fisheye_for_solves()};
  Random random(1);
  IntrinsicsInput input = views.input(0, random, 0);
  input.warp = WarpChoice::off;
  for (int i = 0; i < 6; ++i) {
    const double tilt = i % 2 == 0 ? 0.3 : 0.3 + tilt_rad;
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6, 0.8, 0)).toRotationMatrix();
    const BoardDetection seen =
        views.view(rotation, {0.03 * (i - 3), 0.02 * (i % 3 - 1), 0.2 + 0.01 * i}, random, 0);
    input.views.push_back(input.lattice.list_corners(seen));
    for (auto& corner : input.views.back()) corner.d_pixel_d_edge_shift.setZero();
  }
  return input;
}

TEST(SolveIntrinsics, FailsUnlessBoardNormalsDifferByFiveDegrees) {
  EXPECT_EQ(solve_intrinsics(make_tilted_views(0.085)).status, IntrinsicsStatus::all_parallel);
  EXPECT_EQ(solve_intrinsics(make_tilted_views(0.095)).status, IntrinsicsStatus::ok);
}

TEST(SolveIntrinsics, EstimatesWarpOfExactBoard) {
  const Eigen::Vector2d warp_m(0.0005, -0.0003);
  IntrinsicsInput input = make_exact_views(6, fisheye_for_solves(), warp_m);
  input.warp = WarpChoice::automatic;
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_TRUE(solution.solved_parameters.warp);
  EXPECT_THAT(solution.problem.warp_m, IsNear(warp_m, 1e-8));
  EXPECT_LT(solution.rms_px, 1e-5);
}

TEST(SolveHalfOfViews, ReturnsFailureStatusForParallelBoardsOrUnseenPoints) {
  const IntrinsicsSolution whole = solve_intrinsics(make_tilted_views(0.3));
  ASSERT_TRUE(whole.has_succeeded());
  ASSERT_EQ(whole.views.size(), 6U);
  EXPECT_EQ(solve_half_of_views(whole, 0).status, IntrinsicsStatus::all_parallel);
  IntrinsicsSolution unseen = whole;
  for (Eigen::Vector3d& point : unseen.problem.points) point.z() = BoardProblem::kUnseen;
  EXPECT_EQ(solve_half_of_views(unseen, 0).status, IntrinsicsStatus::no_solution);
}

/// Corners with the same standard deviation have the same weight.
TEST(SolveIntrinsics, WeightsCornersByTheirSds) {
  IntrinsicsInput input = make_exact_views(8);
  Random random(19);
  for (auto& view : input.views) {
    for (auto& corner : view) {
      const bool is_known = corner.point % 5 != 0;
      const double sd_px = corner.point % 2 == 0 ? 0.03 : 0.09;
      corner.sd_px = is_known ? sd_px : 0;
      const double v = random.normal(), u = random.normal();
      corner.pixel += (is_known ? sd_px : 0.3) * Eigen::Vector2d(u, v);
    }
  }
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.views.size(), 8U);
  std::array<double, 3> weights{};
  for (std::size_t i = 0; i < 8; ++i) {
    for (const auto& corner : input.views[i]) {
      const double weight = std::abs(solution.problem.points[i * 120 + corner.point].z());
      double& common = weights[corner.sd_px > 0.05 ? 0 : corner.sd_px > 0 ? 1 : 2];
      if (common == 0) common = weight;
      EXPECT_EQ(weight, common);
    }
  }
  EXPECT_NEAR(weights[1] / weights[0], 3, 0.3);
  EXPECT_NEAR(weights[0] / weights[2], 0.3 / 0.09, 0.3);
  // The mean square of the known corners is that of both kinds: about half have 0.03 px.
  EXPECT_NEAR(weights[0], std::sqrt((0.03 * 0.03 + 0.09 * 0.09) / 2) / 0.09, 0.06);
}

TEST(SolveIntrinsics, KeepsWeightsIfNoSdIsKnown) {
  IntrinsicsInput input = make_exact_views(6);
  Random random(19);
  for (auto& view : input.views) {
    for (auto& corner : view) {
      corner.weight = corner.point % 2 == 0 ? 0.5 : 2;
      const double v = random.normal(), u = random.normal();
      corner.pixel += 0.05 / corner.weight * Eigen::Vector2d(u, v);
    }
  }
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  for (std::size_t i = 0; i < 6; ++i) {
    for (const auto& corner : input.views[i])
      EXPECT_EQ(std::abs(solution.problem.points[i * 120 + corner.point].z()), corner.weight);
  }
  EXPECT_NEAR(solution.rms_px, 0.05, 0.004);
}

/// Splined model that is fast to solve, and a lens up to 58 degrees off the axis.
constexpr LensModel kSmallSpline = splined_lens_model({3, 9, 8, 130});
Lens lens_of_small_spline() {
  return {LensModel::fisheye, std::array{420.0, 422.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006}};
}

TEST(SolveIntrinsics, SplinedLensKeepsAxisAndSidewaysRaysOfFisheye) {
  IntrinsicsInput input = make_exact_views(14, lens_of_small_spline());
  Random random(23);
  for (auto& view : input.views) {
    for (auto& corner : view) {
      const double v = random.normal(), u = random.normal();
      corner.pixel += 0.03 * Eigen::Vector2d(u, v);
    }
  }
  input.lens_model = kSmallSpline;
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_FALSE(solution.solved_parameters.core);
  EXPECT_TRUE(solution.solved_parameters.distortions);
  EXPECT_NEAR(solution.problem.noise_px / solution.rms_px, 1, 0.15);
  EXPECT_NEAR(solution.rms_px, 0.03, 0.004);
  const Lens lens = solution.fitted_lens();
  ASSERT_EQ(solution.problem.fixed_rays.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [pixel, ray] = solution.problem.fixed_rays[i];
    const auto projected = lens.project_point(ray);
    ASSERT_TRUE(projected);
    EXPECT_LT((*projected - pixel).norm(), 0.05) << i;
    const double beside = i == 0 ? 0 : i == 1 ? -0.25 : 0.25;
    EXPECT_THAT(pixel, IsNear(Eigen::Vector2d(402 + beside * 800, 297), 1.5)) << i;
    const auto true_ray = lens_of_small_spline().unproject_pixel(pixel);
    ASSERT_TRUE(true_ray);
    EXPECT_THAT(ray.normalized().eval(), IsNear(true_ray->direction.normalized().eval(), 0.003));
  }
  // OPENCV_FISHEYE fitted to the same corners has the same axes.
  BoardProblem symmetric = solution.problem;
  symmetric.lens_model = LensModel::fisheye;
  symmetric.intrinsics = {420, 422, 402, 297, 0.03, -0.012, 0.004, -0.0006};
  ASSERT_TRUE(solve_board_problem(symmetric, {.core = true, .distortions = true}));
  const auto rotation = fit_lens_rotation(lens, Lens(symmetric.lens_model, symmetric.intrinsics),
                                          list_inlier_pixels(solution.problem));
  ASSERT_TRUE(rotation);
  EXPECT_LT(Eigen::AngleAxisd(*rotation).angle(), 1.2e-4);
}

/// Returns the view and the tag of each outlier of a solution.
std::vector<std::pair<std::size_t, std::size_t>> list_outlier_tags(
    const IntrinsicsSolution& solution, const BoardLattice& lattice) {
  std::vector<std::pair<std::size_t, std::size_t>> tags;
  for (std::size_t i = 0; i < solution.problem.points.size(); ++i) {
    const double weight = solution.problem.points[i].z();
    if (weight >= 0 || weight == BoardProblem::kUnseen) continue;
    tags.emplace_back(i / 120, lattice.get_tag_of_point(i % 120));
  }
  return tags;
}

/// The limit of a displacement is 0.1 px for exact corners.
TEST(SolveFirstStages, MarksTagsWithDisplacedCornerForSplinedLens) {
  for (const double size_px : {0.08, 0.14}) {
    IntrinsicsInput input = make_exact_views(10, lens_of_small_spline());
    const std::size_t view = 4, corner = 9;
    const std::size_t tag = input.lattice.get_tag_of_point(input.views[view][corner].point);
    input.views[view][corner].pixel.y() += size_px;
    const auto solution = InitialSolutions(input).solve_first_stages(kSmallSpline);
    ASSERT_TRUE(solution);
    const auto tags = list_outlier_tags(*solution, input.lattice);
    if (size_px < 0.1) {
      EXPECT_TRUE(tags.empty());
      continue;
    }
    EXPECT_EQ(tags.size(), 4U);
    for (const auto& found : tags) EXPECT_EQ(found, std::pair(view, tag));
  }
}

}  // namespace
}  // namespace vlp
