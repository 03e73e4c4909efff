// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/view_jackknife.h"

#include <Eigen/Cholesky>
#include <limits>
#include <vector>

namespace vlp {
namespace {

struct Layout {
  Eigen::Index intrinsics, poses, warp, states;

  Eigen::Index shared() const { return intrinsics + states - warp; }
};

/// Computes the equations of `count` columns of the transposed Jacobian, with the boards from
/// `pose` on.
ViewEquations::View make_view_equations(const Linearization& at, const Layout& layout,
                                        Eigen::Index first, Eigen::Index count, Eigen::Index pose,
                                        Eigen::Index boards) {
  const Eigen::Index shared = layout.shared(), num_pose_states = 6 * boards;
  Eigen::MatrixXd normal =
      Eigen::MatrixXd::Zero(shared + num_pose_states, shared + num_pose_states);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(shared + num_pose_states);
  const auto reduced_index = [&](Eigen::Index state) {
    if (state < layout.intrinsics) return state;
    if (state >= layout.warp) return layout.intrinsics + state - layout.warp;
    return shared + state - layout.poses - 6 * pose;
  };
  double squares = 0, inliers = 0;
  using Entry = Eigen::SparseMatrix<double>::InnerIterator;
  for (Eigen::Index column = first; column < first + count; ++column) {
    const double residual = column < at.residuals_px.size() ? at.residuals_px[column] : 0;
    squares += residual * residual;
    if (residual != 0) ++inliers;
    for (Entry a(at.jacobian_transposed, column); a; ++a) {
      gradient[reduced_index(a.row())] += a.value() * residual;
      for (Entry b(at.jacobian_transposed, column); b; ++b) {
        normal(reduced_index(a.row()), reduced_index(b.row())) += a.value() * b.value();
      }
    }
  }
  if (num_pose_states == 0) return {normal, gradient, squares, inliers};
  const Eigen::LDLT<Eigen::MatrixXd> poses(
      normal.bottomRightCorner(num_pose_states, num_pose_states));
  const Eigen::MatrixXd cross_block = normal.topRightCorner(shared, num_pose_states);
  const Eigen::VectorXd pose_gradient = gradient.tail(num_pose_states);
  return {normal.topLeftCorner(shared, shared) - cross_block * poses.solve(cross_block.transpose()),
          gradient.head(shared) - cross_block * poses.solve(pose_gradient),
          squares - pose_gradient.dot(poses.solve(pose_gradient)), inliers};
}

/// Returns the change of the common parameters if views with this normal matrix and gradient are
/// left out, to first order; infinite if the others do not determine a lens.
Eigen::VectorXd solve_without_views(const ViewEquations& equations, const Eigen::MatrixXd& normal,
                                    const Eigen::VectorXd& gradient) {
  const Eigen::LDLT<Eigen::MatrixXd> remaining(equations.normal - normal);
  if (remaining.isPositive() && remaining.vectorD().minCoeff() > 0)
    return remaining.solve(gradient);
  return Eigen::VectorXd::Constant(gradient.size(), std::numeric_limits<double>::infinity());
}

}  // namespace

ViewEquations::ViewEquations(const IntrinsicsSolution& solution) {
  const BoardProblem& problem = solution.problem;
  const Linearization at = linearize_board_problem(problem, solution.solved_parameters);
  const auto num_views = static_cast<Eigen::Index>(solution.views.size());
  const auto boards = static_cast<Eigen::Index>(problem.poses.size());
  const Layout layout{at.poses, at.poses, at.poses + 6 * boards, at.jacobian_transposed.rows()};
  const Eigen::Index rows = at.residuals_px.size(), rows_of_view = rows / num_views;
  num_intrinsics = static_cast<Eigen::Index>(problem.intrinsics.size());
  scale = at.scale.head(at.poses);
  normal = make_view_equations(at, layout, rows, at.jacobian_transposed.cols() - rows, 0, 0).normal;
  views.reserve(solution.views.size());
  for (Eigen::Index view = 0; view < num_views; ++view) {
    views.push_back(make_view_equations(at, layout, view * rows_of_view, rows_of_view,
                                        view * boards / num_views, boards / num_views));
    normal += views.back().normal;
  }
}

Eigen::MatrixXd jackknife_covariance(const ViewEquations& equations) {
  const auto views = std::ssize(equations.views);
  const Eigen::Index intrinsics = equations.num_intrinsics, solved = equations.scale.size();
  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(intrinsics, views);
  for (Eigen::Index view = 0; view < views; ++view) {
    const auto& [normal, gradient, squares, count] =
        equations.views[static_cast<std::size_t>(view)];
    const Eigen::VectorXd change = solve_without_views(equations, normal, gradient);
    if (!change.allFinite()) {
      return Eigen::MatrixXd::Constant(intrinsics, intrinsics,
                                       std::numeric_limits<double>::infinity());
    }
    changes.col(view).tail(solved) = equations.scale.cwiseProduct(change.head(solved));
  }
  changes.colwise() -= changes.rowwise().mean().eval();
  const auto n = static_cast<double>(views);
  return (n - 1) / n * changes * changes.transpose();
}

std::vector<double> compute_left_out_squares_px2(const ViewEquations& equations,
                                                 std::size_t blocks) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const std::size_t views = equations.views.size();
  std::vector<double> squares_px2;
  for (std::size_t first = 0; first < views;) {
    ViewEquations::View block = equations.views[first];
    std::size_t end = first + 1;
    for (; end < views && end * blocks / views == first * blocks / views; ++end) {
      block.normal += equations.views[end].normal;
      block.gradient += equations.views[end].gradient;
    }
    const Eigen::VectorXd change = solve_without_views(equations, block.normal, block.gradient);
    for (; first < end; ++first) {
      const auto& [normal, gradient, squares, count] = equations.views[first];
      const double added = 2 * change.dot(gradient) + change.dot(normal * change);
      // Exact corners leave rounding errors.
      constexpr double min_square_px2 = 1e-16;
      const double mean_px2 = (squares + added) / std::max<double>(count, 1);
      squares_px2.push_back(change.allFinite() ? std::max(min_square_px2, mean_px2) : inf);
    }
  }
  return squares_px2;
}

}  // namespace vlp
