// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lenses of 190 degrees, estimated from the corners of boards.
#include <gtest/gtest.h>

#include <map>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/wide_views.h"

namespace vlp {
namespace {

class SolveWideLens : public testing::TestWithParam<bool> {};

TEST_P(SolveWideLens, LensAndBoardWarpMatchTruthForExactCorners) {
  Random random(17);
  const auto input = wide_input(GetParam(), 20, random, 0, {0.0004, -0.0003});
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded()) << describe_status(solution.status);
  EXPECT_EQ(solution.views.size(), 20U);
  // The shift of the edges is estimated on a flat board.
  EXPECT_LT(solution.rms_px, GetParam() ? 1e-3 : 0.02);
  EXPECT_LT(up_to(94, solution.fitted_lens()).worst_px, GetParam() ? 1e-3 : 0.03);
  const Eigen::Vector2d warp_m =
      solution.problem.warp_m.cwiseProduct(input.lattice.board_to_part_warp_ratio());
  EXPECT_LT((warp_m - Eigen::Vector2d(0.0004, -0.0003)).norm(), 1e-5);
}

TEST_P(SolveWideLens, LensMatchesTruthUpTo94DegreesWithNoisyCorners) {
  Random random(18);
  const auto input = wide_input(GetParam(), 40, random, 0.05);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_NEAR(solution.rms_px, 0.05, 0.005);
  EXPECT_LT(up_to(90, solution.fitted_lens()).mean_px, 0.03);
  EXPECT_LT(up_to(94, solution.fitted_lens()).worst_px, 0.1);
  const CalibrationReport report = make_lens_report(solution, input);
  EXPECT_LT(report.uncertainty_worst_px, 0.4);  // at the rim, beyond 94 degrees
  ASSERT_TRUE(report.split_half_difference);
  EXPECT_LT(report.split_half_difference->rms_px, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Boards, SolveWideLens, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

// Compares the parameters of twenty seeds with their covariance.
TEST(ProjectionUncertainty, FocalAndCenterSdsMatchScatterOfWideLens) {
  constexpr int seeds = 20;
  double focal = 0, center = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(100 + static_cast<std::uint64_t>(seed));
    const auto input = wide_input(false, 15, random, 0.1);
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    const Eigen::MatrixXd covariance = ProjectionUncertainty(solution).intrinsics_covariance();
    const auto normalized = [&](Eigen::Index i, double truth) {
      const double error = solution.problem.intrinsics[static_cast<std::size_t>(i)] - truth;
      return error * error / covariance(i, i) / seeds;
    };
    focal += normalized(0, 290);
    center += normalized(2, 501);
  }
  // Chi-squared of 20 freedoms, over 20: from 0.37 to 2.0 in 99 of 100 cases.
  EXPECT_GT(focal, 0.37);
  EXPECT_LT(focal, 2.0);
  EXPECT_GT(center, 0.37);
  EXPECT_LT(center, 2.0);
}

// The same with correlated errors of the corners of a tag.
TEST(ProjectionUncertainty, FocalSdByTagsMatchesScatterForCorrelatedTagErrors) {
  constexpr int seeds = 20;
  double by_tags = 0, by_corners = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(100 + static_cast<std::uint64_t>(seed));
    IntrinsicsInput input = wide_input(false, 15, random, 0.01);
    for (auto& view : input.views) {
      std::map<std::size_t, Eigen::Vector2d> errors_px;
      for (auto& corner : view) {
        const double u = random.normal(), v = random.normal();
        corner.pixel +=
            errors_px.try_emplace(input.lattice.get_tag_of_point(corner.point), 0.1 * u, 0.1 * v)
                .first->second;
      }
    }
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    const auto normalized = [&](const ProjectionUncertainty& uncertainty) {
      const double error = solution.problem.intrinsics[0] - 290;
      return error * error / uncertainty.intrinsics_covariance()(0, 0) / seeds;
    };
    by_tags += normalized({solution, input.lattice});
    by_corners += normalized(ProjectionUncertainty(solution));
  }
  EXPECT_GT(by_tags, 0.37);
  EXPECT_LT(by_tags, 2.0);
  EXPECT_GT(by_corners, 2.0);
}

}  // namespace
}  // namespace vlp
