// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/view_jackknife.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

/// Returns a solution at the minimum for fixed weights.
IntrinsicsSolution solve_to_minimum(bool kalibr, LensModel model, WarpChoice warp, int views) {
  const SyntheticViews synthetic{synthetic_board(kalibr), synthetic_lens()};
  Random random(21);
  IntrinsicsInput input = synthetic.input(views, random, 0.1);
  input.lens_model = model;
  input.warp = warp;
  IntrinsicsSolution solution = solve_intrinsics(input);
  if (solution.has_succeeded() &&
      !solve_board_problem(solution.problem, solution.solved_parameters))
    solution.status = IntrinsicsStatus::no_solution;
  return solution;
}

TEST(JackknifeCovariance, IsInfiniteForSingleView) {
  IntrinsicsSolution solution = solve_to_minimum(false, LensModel::fisheye, WarpChoice::off, 4);
  ASSERT_TRUE(solution.has_succeeded());
  solution.views.resize(1);
  solution.problem.poses.resize(1);
  solution.problem.points.resize(solution.problem.points_per_board());
  const Eigen::MatrixXd found = jackknife_covariance(solution);
  ASSERT_EQ(found.rows(), 8);
  EXPECT_TRUE((found.array() == std::numeric_limits<double>::infinity()).all());
}

/// Compares with solves without the views of a block, whose poses are then estimated. Blocks of
/// seven views in three: 3, 2 and 2 views.
TEST(ComputeLeftOutSquares, MatchesSolvesWithoutBlock) {
  constexpr std::size_t num_views = 7, blocks = 3;
  const SyntheticViews synthetic{synthetic_board(false), synthetic_lens()};
  Random random(22);
  const IntrinsicsInput input = make_views_without_edge_shifts(synthetic, num_views, random, 0.02);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.views.size(), num_views);
  ASSERT_EQ(solution.outliers, 0);
  const auto squares = compute_left_out_squares_px2(solution, blocks);
  ASSERT_EQ(squares.size(), num_views);
  double left_out = 0, in_sample = 0;
  for (const auto& [first, end] : {std::pair<std::size_t, std::size_t>{0, 3}, {3, 5}, {5, 7}}) {
    BoardProblem remaining = solution.problem;
    const auto begin = static_cast<std::ptrdiff_t>(first), last = static_cast<std::ptrdiff_t>(end);
    const auto count = static_cast<std::ptrdiff_t>(solution.problem.points_per_board());
    remaining.poses.erase(remaining.poses.begin() + begin, remaining.poses.begin() + last);
    remaining.points.erase(remaining.points.begin() + begin * count,
                           remaining.points.begin() + last * count);
    ASSERT_TRUE(solve_board_problem(remaining, solution.solved_parameters));
    const Lens lens(remaining.lens_model, remaining.intrinsics);
    for (std::size_t view = first; view < end; ++view) {
      const auto pose = estimate_view_pose(input.views[view], lens);
      const auto own = estimate_view_pose(input.views[view], solution.fitted_lens());
      ASSERT_TRUE(pose && own);
      EXPECT_NEAR(std::sqrt(squares[view]), pose->rms_px, 0.02 * pose->rms_px) << view;
      left_out += squares[view];
      in_sample += own->rms_px * own->rms_px;
    }
  }
  EXPECT_GT(left_out, 1.05 * in_sample);
}

TEST(ComputeLeftOutSquares, IsInfiniteWithoutRemainingViews) {
  const IntrinsicsSolution solution =
      solve_to_minimum(false, LensModel::fisheye, WarpChoice::off, 4);
  ASSERT_TRUE(solution.has_succeeded());
  const auto squares = compute_left_out_squares_px2(solution, 1);
  ASSERT_EQ(squares.size(), 4U);
  for (const double square : squares) EXPECT_EQ(square, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace vlp
