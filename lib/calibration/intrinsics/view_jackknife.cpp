// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/view_jackknife.h"

#include <Eigen/Cholesky>
#include <limits>
#include <vector>

namespace vlp {
namespace {

/// Normal equations of some rows in the parameters common to all views, intrinsics and warp, with
/// the poses of the view eliminated.
struct ReducedEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
};

struct Layout {
  Eigen::Index intrinsics, poses, warp, states;

  Eigen::Index shared() const { return intrinsics + states - warp; }
};

/// Computes the equations of `count` columns of the transposed Jacobian, with the boards from
/// `pose` on.
ReducedEquations compute_reduced_equations(const Linearization& at, const Layout& layout,
                                           Eigen::Index first, Eigen::Index count,
                                           Eigen::Index pose, Eigen::Index boards) {
  const Eigen::Index shared = layout.shared(), num_pose_states = 6 * boards;
  Eigen::MatrixXd normal =
      Eigen::MatrixXd::Zero(shared + num_pose_states, shared + num_pose_states);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(shared + num_pose_states);
  const auto reduced_index = [&](Eigen::Index state) {
    if (state < layout.intrinsics) return state;
    if (state >= layout.warp) return layout.intrinsics + state - layout.warp;
    return shared + state - layout.poses - 6 * pose;
  };
  using Entry = Eigen::SparseMatrix<double>::InnerIterator;
  for (Eigen::Index column = first; column < first + count; ++column) {
    const double residual = column < at.residuals_px.size() ? at.residuals_px[column] : 0;
    for (Entry a(at.jacobian_transposed, column); a; ++a) {
      gradient[reduced_index(a.row())] += a.value() * residual;
      for (Entry b(at.jacobian_transposed, column); b; ++b) {
        normal(reduced_index(a.row()), reduced_index(b.row())) += a.value() * b.value();
      }
    }
  }
  if (num_pose_states == 0) return {normal, gradient};
  const Eigen::LDLT<Eigen::MatrixXd> poses(
      normal.bottomRightCorner(num_pose_states, num_pose_states));
  const Eigen::MatrixXd cross_block = normal.topRightCorner(shared, num_pose_states);
  return {normal.topLeftCorner(shared, shared) - cross_block * poses.solve(cross_block.transpose()),
          gradient.head(shared) - cross_block * poses.solve(gradient.tail(num_pose_states))};
}

}  // namespace

Eigen::MatrixXd estimate_intrinsics_covariance_by_jackknife(const IntrinsicsSolution& solution) {
  const BoardProblem& problem = solution.problem;
  const Linearization at = linearize_board_problem(problem, solution.solved_parameters);
  const auto views = static_cast<Eigen::Index>(solution.views.size());
  const auto boards = static_cast<Eigen::Index>(problem.poses.size());
  const auto intrinsics = static_cast<Eigen::Index>(problem.intrinsics.size());
  const Layout layout{at.poses, at.poses, at.poses + 6 * boards, at.jacobian_transposed.rows()};
  const Eigen::Index rows = at.residuals_px.size(), rows_of_view = rows / views;

  std::vector<ReducedEquations> all_equations;
  all_equations.reserve(solution.views.size());
  for (Eigen::Index view = 0; view < views; ++view) {
    all_equations.push_back(compute_reduced_equations(at, layout, view * rows_of_view, rows_of_view,
                                                      view * boards / views, boards / views));
  }
  Eigen::MatrixXd normal =
      compute_reduced_equations(at, layout, rows, at.jacobian_transposed.cols() - rows, 0, 0)
          .normal;
  for (const ReducedEquations& view_equations : all_equations) normal += view_equations.normal;

  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(intrinsics, views);
  for (Eigen::Index view = 0; view < views; ++view) {
    const ReducedEquations& view_equations = all_equations[static_cast<std::size_t>(view)];
    const Eigen::LDLT<Eigen::MatrixXd> remaining(normal - view_equations.normal);
    if (!remaining.isPositive() || !(remaining.vectorD().minCoeff() > 0)) {
      return Eigen::MatrixXd::Constant(intrinsics, intrinsics,
                                       std::numeric_limits<double>::infinity());
    }
    changes.col(view).tail(at.poses) = at.scale.head(at.poses).cwiseProduct(
        remaining.solve(view_equations.gradient).head(at.poses));
  }
  changes.colwise() -= changes.rowwise().mean().eval();
  const auto n = static_cast<double>(views);
  return (n - 1) / n * changes * changes.transpose();
}

}  // namespace vlp
