// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_print.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "calibration/intrinsics/lens_estimate.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

constexpr double kPrintSd = 5e-4;

class EstimateAspectEffect : public testing::TestWithParam<bool> {};

/// Returns the solution from views of a board that is wider than stated by this factor, with
/// exact corners.
IntrinsicsSolution solve_stretched(bool kalibr, double factor) {
  SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
  views.stretch = {factor, 1};
  Random random(3);
  return solve_intrinsics(views.input(20, random, 0));
}

/// Compares full solves with a wider board and with the board as stated.
TEST_P(EstimateAspectEffect, MatchesNegativeLensChangeOfSolveWithWiderBoard) {
  const IntrinsicsSolution stated = solve_stretched(GetParam(), 1);
  const IntrinsicsSolution wider = solve_stretched(GetParam(), 1 + std::sqrt(2) * kPrintSd);
  ASSERT_TRUE(stated.has_succeeded() && wider.has_succeeded());
  const auto effect = estimate_aspect_effect(stated, kPrintSd);
  ASSERT_TRUE(effect);
  const auto expected =
      compare_projections(stated.fitted_lens(), wider.fitted_lens(), {800, 600}, even);
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
    const auto error = compare_projections(solution.fitted_lens(), views.lens, {800, 600}, even);
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

INSTANTIATE_TEST_SUITE_P(Boards, EstimateAspectEffect, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

}  // namespace
}  // namespace vlp
