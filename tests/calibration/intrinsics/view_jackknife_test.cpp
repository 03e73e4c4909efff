// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/view_jackknife.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the jackknife covariance from solves without one view each, over all states.
Eigen::MatrixXd compute_covariance_by_dense_solves(const IntrinsicsSolution& solution) {
  const Linearization at = linearize_board_problem(solution.problem, solution.solved_parameters);
  const Eigen::MatrixXd jacobian =
      (at.scale.cwiseInverse().asDiagonal() * Eigen::MatrixXd(at.jacobian_transposed)).transpose();
  const auto views = static_cast<Eigen::Index>(solution.views.size());
  const Eigen::Index rows = at.residuals_px.size() / views;
  const Eigen::Index poses_per_view =
      static_cast<Eigen::Index>(solution.problem.poses.size()) / views;
  std::vector<Eigen::VectorXd> changes;
  for (Eigen::Index view = 0; view < views; ++view) {
    Eigen::MatrixXd remaining = jacobian;
    remaining.middleRows(view * rows, rows).setZero();
    Eigen::MatrixXd normal = remaining.transpose() * remaining;
    // Fixes the poses of the omitted view.
    const Eigen::Index first = at.poses + 6 * poses_per_view * view, count = 6 * poses_per_view;
    normal.block(first, first, count, count).setIdentity();
    // The gradient over all rows is 0 at the solution.
    Eigen::VectorXd gradient = jacobian.middleRows(view * rows, rows).transpose() *
                               at.residuals_px.segment(view * rows, rows);
    gradient.segment(first, count).setZero();
    const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::VectorXd change =
        scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(gradient)));
    Eigen::VectorXd of_intrinsics =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(solution.problem.intrinsics.size()));
    of_intrinsics.tail(at.poses) = change.head(at.poses);
    changes.push_back(of_intrinsics);
  }
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(changes[0].size());
  for (const Eigen::VectorXd& change : changes) mean += change / static_cast<double>(views);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(mean.size(), mean.size());
  for (const Eigen::VectorXd& change : changes)
    covariance += (change - mean) * (change - mean).transpose();
  return covariance * (static_cast<double>(views - 1) / static_cast<double>(views));
}

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

TEST(EstimateIntrinsicsCovarianceByJackknife, MatchesDenseSolvesWithoutOneView) {
  for (const bool kalibr : {false, true}) {
    const LensModel model = kalibr ? LensModel::fisheye : LensModel::opencv4;
    const IntrinsicsSolution solution =
        solve_to_minimum(kalibr, model, kalibr ? WarpChoice::off : WarpChoice::on, 5);
    ASSERT_TRUE(solution.has_succeeded());
    ASSERT_EQ(solution.solved_parameters.warp, !kalibr);
    const Eigen::MatrixXd found = estimate_intrinsics_covariance_by_jackknife(solution);
    const Eigen::MatrixXd expected = compute_covariance_by_dense_solves(solution);
    ASSERT_EQ(found.rows(), 8);
    ASSERT_EQ(found.cols(), 8);
    const Eigen::VectorXd sds = expected.diagonal().cwiseSqrt();
    ASSERT_GT(sds.minCoeff(), 0);
    const Eigen::VectorXd inverse = sds.cwiseInverse();
    EXPECT_THAT((inverse.asDiagonal() * found * inverse.asDiagonal()).eval(),
                IsNear((inverse.asDiagonal() * expected * inverse.asDiagonal()).eval(), 0.01))
        << kalibr;
  }
}

TEST(EstimateIntrinsicsCovarianceByJackknife, IsInfiniteForSingleView) {
  IntrinsicsSolution solution = solve_to_minimum(false, LensModel::fisheye, WarpChoice::off, 4);
  ASSERT_TRUE(solution.has_succeeded());
  solution.views.resize(1);
  solution.problem.poses.resize(1);
  solution.problem.points.resize(solution.problem.num_points_per_board());
  const Eigen::MatrixXd found = estimate_intrinsics_covariance_by_jackknife(solution);
  ASSERT_EQ(found.rows(), 8);
  EXPECT_TRUE((found.array() == std::numeric_limits<double>::infinity()).all());
}

/// Compares with solves without the views of a block, whose poses are then estimated. Blocks of
/// seven views in three: 3, 2 and 2 views.
TEST(ComputeLeftOutMeanSquares, MatchesSolvesWithoutBlock) {
  constexpr std::size_t num_views = 7, blocks = 3;
  const SyntheticViews synthetic{synthetic_board(false), synthetic_lens()};
  Random random(22);
  const IntrinsicsInput input = make_views_without_edge_shifts(synthetic, num_views, random, 0.02);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.views.size(), num_views);
  ASSERT_EQ(solution.outliers, 0);
  const auto squares = compute_left_out_mean_squares_px2(solution, blocks);
  ASSERT_EQ(squares.size(), num_views);
  double left_out = 0, in_sample = 0;
  for (const auto& [first, end] : {std::pair<std::size_t, std::size_t>{0, 3}, {3, 5}, {5, 7}}) {
    BoardProblem remaining = solution.problem;
    const auto begin = static_cast<std::ptrdiff_t>(first), last = static_cast<std::ptrdiff_t>(end);
    const auto count = static_cast<std::ptrdiff_t>(solution.problem.num_points_per_board());
    remaining.poses.erase(remaining.poses.begin() + begin, remaining.poses.begin() + last);
    remaining.points.erase(remaining.points.begin() + begin * count,
                           remaining.points.begin() + last * count);
    ASSERT_TRUE(solve_board_problem(remaining, solution.solved_parameters));
    const Lens lens(remaining.lens_model, remaining.intrinsics);
    for (std::size_t view = first; view < end; ++view) {
      const auto pose = estimate_board_view_pose(input.views[view], lens);
      const auto own = estimate_board_view_pose(input.views[view], solution.fitted_lens());
      ASSERT_TRUE(pose && own);
      EXPECT_NEAR(std::sqrt(squares[view]), pose->rms_px, 0.02 * pose->rms_px) << view;
      left_out += squares[view];
      in_sample += own->rms_px * own->rms_px;
    }
  }
  EXPECT_GT(left_out, 1.05 * in_sample);
}

TEST(ComputeLeftOutMeanSquares, IsInfiniteWithoutRemainingViews) {
  const IntrinsicsSolution solution =
      solve_to_minimum(false, LensModel::fisheye, WarpChoice::off, 4);
  ASSERT_TRUE(solution.has_succeeded());
  const auto squares = compute_left_out_mean_squares_px2(solution, 1);
  ASSERT_EQ(squares.size(), 4U);
  for (const double square : squares) EXPECT_EQ(square, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace vlp
