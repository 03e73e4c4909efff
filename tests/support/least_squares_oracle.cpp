// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/least_squares_oracle.h"

#include <Eigen/QR>

namespace vlp {

Eigen::MatrixXd differentiate_numerically(const VectorFunction& function, const Eigen::VectorXd& at,
                                          double step) {
  Eigen::MatrixXd jacobian(function(at).size(), at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const Eigen::VectorXd change = step * Eigen::VectorXd::Unit(at.size(), i);
    jacobian.col(i) = (function(at + change) - function(at - change)) / (2 * step);
  }
  return jacobian;
}

double DenseSolution::degrees_of_freedom(Eigen::Index first_residuals) const {
  const auto rows = jacobian.topRows(first_residuals);
  return static_cast<double>(first_residuals) - (rows * covariance * rows.transpose()).trace();
}

DenseSolution solve_least_squares(const VectorFunction& residuals, Eigen::VectorXd start,
                                  double step) {
  for (int iteration = 0; iteration < 10; ++iteration) {
    const Eigen::MatrixXd jacobian = differentiate_numerically(residuals, start, step);
    const Eigen::VectorXd change = jacobian.colPivHouseholderQr().solve(residuals(start));
    start -= change;
    if (change.norm() < 1e-10) break;
  }
  const Eigen::MatrixXd jacobian = differentiate_numerically(residuals, start, step);
  const Eigen::MatrixXd root =
      jacobian.householderQr().matrixQR().topRows(jacobian.cols()).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd inverse = root.triangularView<Eigen::Upper>().solve(
      Eigen::MatrixXd::Identity(root.rows(), root.cols()));
  return {start, residuals(start), jacobian, inverse * inverse.transpose()};
}

}  // namespace vlp
