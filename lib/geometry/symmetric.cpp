// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/symmetric.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>

namespace vlp {
namespace {

template <int N>
SymmetricEigen<N> decompose(const Eigen::Matrix<double, N, N>& matrix) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver;
  if constexpr (N == 2) {
    solver.computeDirect(matrix);
  } else {
    solver.compute(matrix);
  }
  if (solver.info() == Eigen::Success) return {solver.eigenvalues(), solver.eigenvectors()};
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {Eigen::Matrix<double, N, 1>::Constant(matrix.rows(), nan),
          Eigen::Matrix<double, N, N>::Constant(matrix.rows(), matrix.cols(), nan)};
}

}  // namespace

SymmetricEigen<2> eigendecompose(const Eigen::Matrix2d& matrix) { return decompose(matrix); }

SymmetricEigen<Eigen::Dynamic> eigendecompose(const Eigen::MatrixXd& matrix) {
  return decompose(matrix);
}

std::optional<Eigen::Matrix4d> invert_positive_definite(const Eigen::Matrix4d& matrix) {
  const Eigen::LLT<Eigen::Matrix4d> factor(matrix);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix4d inverse = factor.solve(Eigen::Matrix4d::Identity());
  if (!inverse.allFinite()) return std::nullopt;
  return inverse;
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.ldlt().solve(b);
}

}  // namespace vlp
