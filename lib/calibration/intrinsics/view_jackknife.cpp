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
struct Share {
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
};

struct Layout {
  Eigen::Index intrinsics, poses, warp, states;

  Eigen::Index shared() const { return intrinsics + states - warp; }
};

/// Computes the equations of `count` columns of the transposed Jacobian, with the boards from
/// `pose` on.
Share share_of(const Linearization& at, const Layout& layout, Eigen::Index first,
               Eigen::Index count, Eigen::Index pose, Eigen::Index boards) {
  const Eigen::Index shared = layout.shared(), own = 6 * boards;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(shared + own, shared + own);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(shared + own);
  const auto place = [&](Eigen::Index state) {
    if (state < layout.intrinsics) return state;
    if (state >= layout.warp) return layout.intrinsics + state - layout.warp;
    return shared + state - layout.poses - 6 * pose;
  };
  using Entry = Eigen::SparseMatrix<double>::InnerIterator;
  for (Eigen::Index column = first; column < first + count; ++column) {
    const double residual = column < at.residuals_px.size() ? at.residuals_px[column] : 0;
    for (Entry a(at.jacobian_transposed, column); a; ++a) {
      gradient[place(a.row())] += a.value() * residual;
      for (Entry b(at.jacobian_transposed, column); b; ++b) {
        normal(place(a.row()), place(b.row())) += a.value() * b.value();
      }
    }
  }
  if (own == 0) return {normal, gradient};
  const Eigen::LDLT<Eigen::MatrixXd> poses(normal.bottomRightCorner(own, own));
  const Eigen::MatrixXd across = normal.topRightCorner(shared, own);
  return {normal.topLeftCorner(shared, shared) - across * poses.solve(across.transpose()),
          gradient.head(shared) - across * poses.solve(gradient.tail(own))};
}

}  // namespace

Eigen::MatrixXd covariance_by_views(const IntrinsicsSolution& solution) {
  const BoardProblem& problem = solution.problem;
  const Linearization at = linearized(problem, solution.solved_for);
  const auto views = static_cast<Eigen::Index>(solution.views.size());
  const auto boards = static_cast<Eigen::Index>(problem.poses.size());
  const auto intrinsics = static_cast<Eigen::Index>(problem.intrinsics.size());
  const Layout layout{at.poses, at.poses, at.poses + 6 * boards, at.jacobian_transposed.rows()};
  const Eigen::Index rows = at.residuals_px.size(), rows_of_view = rows / views;

  std::vector<Share> shares;
  shares.reserve(solution.views.size());
  for (Eigen::Index view = 0; view < views; ++view) {
    shares.push_back(share_of(at, layout, view * rows_of_view, rows_of_view, view * boards / views,
                              boards / views));
  }
  Eigen::MatrixXd normal =
      share_of(at, layout, rows, at.jacobian_transposed.cols() - rows, 0, 0).normal;
  for (const Share& share : shares) normal += share.normal;

  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(intrinsics, views);
  for (Eigen::Index view = 0; view < views; ++view) {
    const Share& share = shares[static_cast<std::size_t>(view)];
    const Eigen::LDLT<Eigen::MatrixXd> rest(normal - share.normal);
    if (!rest.isPositive() || !(rest.vectorD().minCoeff() > 0)) {
      return Eigen::MatrixXd::Constant(intrinsics, intrinsics,
                                       std::numeric_limits<double>::infinity());
    }
    changes.col(view).tail(at.poses) =
        at.scale.head(at.poses).cwiseProduct(rest.solve(share.gradient).head(at.poses));
  }
  changes.colwise() -= changes.rowwise().mean().eval();
  const auto n = static_cast<double>(views);
  return (n - 1) / n * changes * changes.transpose();
}

}  // namespace vlp
