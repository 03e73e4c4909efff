// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_print.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "calibration/intrinsics/lens_estimate.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

constexpr double kPrintSd = 5e-4;

class ComputeBoardAspectErrorEffectOnLens : public testing::TestWithParam<bool> {};

/// Returns the solution from views of a board that is wider than stated by this factor, with
/// exact corners.
IntrinsicsSolution solve_stretched(bool kalibr, double factor) {
  SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
  views.stretch = {factor, 1};
  Random random(3);
  return solve_intrinsics(views.input(20, random, 0));
}

/// Compares full solves with a wider board and with the board as stated.
TEST_P(ComputeBoardAspectErrorEffectOnLens, MatchesNegativeLensChangeOfSolveWithWiderBoard) {
  const IntrinsicsSolution stated = solve_stretched(GetParam(), 1);
  const IntrinsicsSolution wider = solve_stretched(GetParam(), 1 + std::sqrt(2) * kPrintSd);
  ASSERT_TRUE(stated.has_succeeded() && wider.has_succeeded());
  const auto effect = compute_board_aspect_error_effect_on_lens(stated, kPrintSd);
  ASSERT_TRUE(effect);
  const auto expected =
      compute_projection_difference(stated.fitted_lens(), wider.fitted_lens(), {800, 600}, even);
  ASSERT_TRUE(expected);
  EXPECT_GT(expected->rms_px, 0.01);
  // A full solve also estimates the shift of the edges, which a board that is wider changes.
  EXPECT_NEAR(effect->rms_px / expected->rms_px, 1, 0.2);
  // The lens of a wider board changes in the opposite direction: its stated points are too close.
  const auto& a = stated.problem.intrinsics;
  const auto& b = wider.problem.intrinsics;
  const Eigen::Vector2d change(a[0] - b[0], a[1] - b[1]);
  EXPECT_GT(change.norm(), 0.05);
  EXPECT_LT((effect->intrinsics.head<2>() - change).norm(), 0.2 * change.norm());
}

TEST_P(ComputeBoardAspectErrorEffectOnLens, RmsIsProportionalToPrintStandardDeviation) {
  const IntrinsicsSolution stated = solve_stretched(GetParam(), 1);
  ASSERT_TRUE(stated.has_succeeded());
  const auto one = compute_board_aspect_error_effect_on_lens(stated, kPrintSd);
  const auto two = compute_board_aspect_error_effect_on_lens(stated, 2 * kPrintSd);
  ASSERT_TRUE(one && two);
  EXPECT_NEAR(two->rms_px / one->rms_px, 2, 0.05);
}

TEST(ComputeBoardAspectErrorEffectOnLens, VanishesForExactPrintWithPinholeLens) {
  const std::array parameters{520.0, 521.0, 402.0, 297.0};
  const SyntheticViews views{synthetic_board(false), Lens(LensModel::pinhole, parameters)};
  Random random(4);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(20, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  const auto exact = compute_board_aspect_error_effect_on_lens(solution, 1e-9);
  const auto printed = compute_board_aspect_error_effect_on_lens(solution, kPrintSd);
  ASSERT_TRUE(exact && printed);
  EXPECT_LT(exact->rms_px, 0.01 * printed->rms_px);
  EXPECT_GT(printed->rms_px, 0.01);
}

/// Monte Carlo: errors of lenses from boards with random print and random noise, against the
/// uncertainty that one of them states.
TEST(EstimateLens, ReportedUncertaintyIncludesBoardPrintError) {
  constexpr double noise_px = 0.02;
  constexpr int draws = 40;
  SyntheticViews views{synthetic_board(false), synthetic_lens()};
  views.board.print_sd = kPrintSd;
  Random random(11);
  double squares = 0;
  for (int draw = 0; draw < draws; ++draw) {
    views.stretch = {1 + kPrintSd * random.normal(), 1 + kPrintSd * random.normal()};
    const IntrinsicsSolution solution = solve_intrinsics(views.input(20, random, noise_px));
    ASSERT_TRUE(solution.has_succeeded());
    const auto error =
        compute_projection_difference(solution.fitted_lens(), views.lens, {800, 600}, even);
    ASSERT_TRUE(error);
    squares += error->worst_px * error->worst_px / draws;
  }
  views.stretch = {1, 1};
  LensViews stated{{}, views.board};
  stated.views.reserve(20);
  for (int i = 0; i < 20; ++i) {
    stated.views.push_back(
        {std::to_string(i), views.imager_px, views.random_view(random, noise_px)});
  }
  const LensEstimate with_print = estimate_lens(stated);
  stated.board.print_sd = 0;
  const LensEstimate exact = estimate_lens(stated);
  ASSERT_TRUE(with_print.has_succeeded() && exact.has_succeeded());
  const double ratio = std::sqrt(squares) / with_print.report.uncertainty_worst_px;
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(ratio, 1.1);
  EXPECT_GT(std::sqrt(squares) / exact.report.uncertainty_worst_px, 1.5);
  EXPECT_GT(with_print.report.uncertainty_mean_px, exact.report.uncertainty_mean_px);
}

INSTANTIATE_TEST_SUITE_P(Boards, ComputeBoardAspectErrorEffectOnLens, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

/// Returns a solution with exact corners of four warped boards of 7 x 5 points.
IntrinsicsSolution make_exact_solution() {
  IntrinsicsSolution solution{};
  solution.status = IntrinsicsStatus::ok;
  solution.views = {0, 1, 2, 3};
  BoardProblem& problem = solution.problem;
  problem.lens_model = LensModel::pinhole;
  problem.intrinsics = {500, 510, 405, 290};
  problem.imager_px = {800, 600};
  problem.cols = 7;
  problem.rows = 5;
  problem.spacing_m = 0.03;
  problem.warp_m = {0.01, -0.006};
  problem.poses = {{{0.5, -0.3, 0.2}, {-0.08, -0.05, 0.3}},
                   {{-0.4, 0.5, -0.1}, {-0.12, -0.06, 0.28}},
                   {{0.1, 0.6, 0.3}, {-0.06, -0.07, 0.35}},
                   {{-0.5, -0.4, 0.1}, {-0.1, -0.03, 0.32}}};
  problem.points.assign(4 * 35, {0, 0, 1});
  return solution;
}

/// Projects the points of the boards, `factor` times as wide as stated.
std::vector<Eigen::Vector2d> project_boards(const BoardProblem& problem, double factor) {
  std::vector<Eigen::Vector2d> pixels;
  for (const BoardPose& pose : problem.poses) {
    const Eigen::Quaterniond rotation(
        Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()));
    for (int row = 0; row < 5; ++row) {
      for (int col = 0; col < 7; ++col) {
        const double x = (col - 3) / 3.0, y = (row - 2) / 2.0;
        const Eigen::Vector3d point(factor * 0.03 * col, 0.03 * row,
                                    0.01 * (1 - x * x) - 0.006 * (1 - y * y));
        const Eigen::Vector3d in_camera = rotation * point + pose.translation_m;
        pixels.emplace_back(500 * in_camera.x() / in_camera.z() + 405,
                            510 * in_camera.y() / in_camera.z() + 290);
      }
    }
  }
  return pixels;
}

TEST(ComputeBoardAspectErrorEffectOnLens, MatchesSolveWithMovedCorners) {
  IntrinsicsSolution solution = make_exact_solution();
  const double factor = 1 + std::sqrt(2) * 0.002;
  const auto stated = project_boards(solution.problem, 1);
  const auto wider = project_boards(solution.problem, factor);
  ASSERT_EQ(stated.size(), solution.problem.points.size());
  for (std::size_t i = 0; i < stated.size(); ++i) {
    solution.problem.points[i].head<2>() = stated[i];
  }
  solution.problem.points[40].z() = -1;
  BoardProblem moved = solution.problem;
  for (std::size_t i = 0; i < stated.size(); ++i) {
    moved.points[i].head<2>() += stated[i] - wider[i];
  }
  ASSERT_TRUE(solve_board_problem(moved, solution.solved_parameters));
  const Lens lens = solution.fitted_lens(), other(LensModel::pinhole, moved.intrinsics);
  const ImageRegion region{{300, 200}, {500, 200}, {500, 400}, {300, 400}};
  for (const ImageRegion& part : {ImageRegion(), region}) {
    const auto effect = compute_board_aspect_error_effect_on_lens(solution, 0.002, part);
    ASSERT_TRUE(effect);
    ASSERT_EQ(effect->intrinsics.size(), 4);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(effect->intrinsics[static_cast<Eigen::Index>(k)],
                  moved.intrinsics[k] - solution.problem.intrinsics[k], 1e-5);
    }
    EXPECT_GT(effect->intrinsics.norm(), 0.1);
    const auto everywhere = compute_projection_difference(lens, other, {800, 600}, even);
    const auto inside =
        compute_projection_difference(lens, other, {800, 600}, [&](const Eigen::Vector2d& pixel) {
          const Eigen::Vector2d from_middle = (pixel - Eigen::Vector2d(400, 300)).cwiseAbs();
          return part.empty() || from_middle.maxCoeff() <= 100
                     ? 1.0
                     : std::numeric_limits<double>::infinity();
        });
    ASSERT_TRUE(everywhere && inside);
    EXPECT_NEAR(effect->rms_px, everywhere->rms_px, 1e-6);
    EXPECT_NEAR(effect->mean_in_region_px, inside->mean_px, 1e-6);
    EXPECT_NEAR(effect->worst_in_region_px, inside->worst_px, 1e-6);
  }
}

TEST(ComputeBoardAspectErrorEffectOnLens, ReturnsNulloptIfPointIsBehindCameraUnlessUnseen) {
  IntrinsicsSolution solution = make_exact_solution();
  const auto stated = project_boards(solution.problem, 1);
  for (std::size_t i = 0; i < stated.size(); ++i) {
    solution.problem.points[i].head<2>() = stated[i];
  }
  // A board that begins in front of the camera and ends behind it.
  solution.problem.poses.push_back({{0, 1.5, 0}, {0, 0, 0.1}});
  for (int i = 0; i < 35; ++i) {
    solution.problem.points.emplace_back(400 + 40 * (i % 7), 300 + 40 * (i / 7),
                                         i % 7 < 3 ? 1 : BoardProblem::kUnseen);
  }
  EXPECT_TRUE(compute_board_aspect_error_effect_on_lens(solution, 0.002));
  for (std::size_t i = 140; i < 175; ++i) solution.problem.points[i].z() = 1;
  EXPECT_FALSE(compute_board_aspect_error_effect_on_lens(solution, 0.002));
}

TEST(ComputeBoardAspectErrorEffectOnLens, ReturnsNulloptForRegionWithoutPixels) {
  IntrinsicsSolution solution = make_exact_solution();
  const auto stated = project_boards(solution.problem, 1);
  for (std::size_t i = 0; i < stated.size(); ++i) {
    solution.problem.points[i].head<2>() = stated[i];
  }
  const ImageRegion outside{{900, 700}, {950, 700}, {950, 800}};
  EXPECT_FALSE(compute_board_aspect_error_effect_on_lens(solution, 0.002, outside));
}

}  // namespace
}  // namespace vlp
