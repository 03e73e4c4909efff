// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

/// Decompositions of symmetric matrices for several callers, compiled once: each use of Eigen's
/// decompositions takes several seconds of compile time.
namespace vlp {

/// Eigendecomposition A = V diag(values) V^T of a symmetric matrix A. Eigenvalues are ascending;
/// column i of `vectors` (V) is the eigenvector of values[i], of unit length. 2 x 2: in closed
/// form; otherwise all are NaN if the iteration does not converge.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};

/// Computes the eigendecomposition of a symmetric matrix. Reads its lower triangle only.
SymmetricEigen<2> eigendecompose(const Eigen::Matrix2d& matrix);
SymmetricEigen<Eigen::Dynamic> eigendecompose(const Eigen::MatrixXd& matrix);

/// Computes the inverse of a positive definite matrix, such as one of normal equations. Returns
/// std::nullopt if the matrix is not positive definite or its inverse is not finite.
std::optional<Eigen::Matrix4d> invert_positive_definite(const Eigen::Matrix4d& matrix);

/// Solves A X = B for a symmetric matrix A, by LDL^T. Returns X.
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace vlp
