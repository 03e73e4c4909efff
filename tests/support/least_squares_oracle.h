// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>

namespace vlp {

using VectorFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// Returns the derivative of a function from central difference quotients.
Eigen::MatrixXd differentiate_numerically(const VectorFunction& function, const Eigen::VectorXd& at,
                                          double step = 1e-6);

/// Least-squares solution by Gauss-Newton steps with one dense, numeric
/// Jacobian.
struct DenseSolution {
  Eigen::VectorXd unknowns;
  /// Residuals and Jacobian J at the solution.
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  /// (J'J)^-1.
  Eigen::MatrixXd covariance;

  /// Returns the first residuals' number minus the trace of their hat matrix.
  double degrees_of_freedom(Eigen::Index first_residuals) const;
};

/// Minimizes the sum of the squared residuals, which have unit variance.
DenseSolution solve_least_squares(const VectorFunction& residuals, Eigen::VectorXd start,
                                  double step = 1e-6);

}  // namespace vlp
