// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/view_jackknife.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <vector>

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

}  // namespace
}  // namespace vlp
