// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/error_propagation.h"

#include <Eigen/Cholesky>

namespace vlp {

std::optional<MatrixX> differentiate_solution(const PerturbedSolve& solve,
                                              const Eigen::VectorXd& nominal,
                                              const MatrixX& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return {};
  const Eigen::MatrixXd lower = factor.matrixL();
  Eigen::MatrixXd changes(lower.cols(), nominal.size());
  for (Eigen::Index i = 0; i < lower.cols(); ++i) {
    double fraction = 1;
    auto solution = solve(lower.col(i));
    if (!solution) {
      fraction = 1.0 / 16;
      solution = solve(fraction * lower.col(i));
    }
    if (!solution) return {};
    changes.row(i) = (*solution - nominal).transpose() / fraction;
  }
  // J L = moved'.
  const MatrixX jacobian = factor.matrixU().solve(changes).transpose();
  if (!jacobian.allFinite()) return {};
  return jacobian;
}

}  // namespace vlp
