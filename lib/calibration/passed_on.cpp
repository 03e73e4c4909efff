// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/passed_on.h"

#include <Eigen/Cholesky>

namespace vlp {

std::optional<MatrixX> jacobian_of(const SolvedWith& solved, const Eigen::VectorXd& exact,
                                   const MatrixX& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return {};
  const Eigen::MatrixXd lower = factor.matrixL();
  Eigen::MatrixXd moved(lower.cols(), exact.size());
  for (Eigen::Index i = 0; i < lower.cols(); ++i) {
    double fraction = 1;
    auto by_one = solved(lower.col(i));
    if (!by_one) {
      fraction = 1.0 / 16;
      by_one = solved(fraction * lower.col(i));
    }
    if (!by_one) return {};
    moved.row(i) = (*by_one - exact).transpose() / fraction;
  }
  // J L = moved'.
  const MatrixX jacobian = factor.matrixU().solve(moved).transpose();
  if (!jacobian.allFinite()) return {};
  return jacobian;
}

}  // namespace vlp
