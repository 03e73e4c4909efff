// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

/// Decompositions of symmetric matrices that are needed in several places, compiled once: each of
/// Eigen's costs the compiler several seconds wherever it stands.
namespace vlp {

/// A = V diag(values) V^T: the values ascend, the columns of V have unit length. All are NaN where
/// the iteration does not converge.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};

/// Of the lower half of a matrix.
SymmetricEigen<2> symmetric_eigen(const Eigen::Matrix2d& matrix);
SymmetricEigen<Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& matrix);

/// The inverse of a positive definite matrix, as of normal equations; nothing where it is not
/// positive, or has no finite inverse.
std::optional<Eigen::Matrix4d> inverse_of_positive(const Eigen::Matrix4d& matrix);

/// A^-1 B by LDL^T.
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace vlp
