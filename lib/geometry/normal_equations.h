// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

/// Normal equations of least squares with a size fixed at compile time, in plain loops. Eigen's
/// products and decompositions of 9 x 9 matrices are no faster and take minutes to compile.
namespace vlp {

/// Normal equations of linear least squares with n unknowns, accumulated row by row: information
/// matrix J^T W J and gradient J^T W r. J are the derivatives, W the weights and r the residuals.
template <std::size_t n>
struct Normal {
  std::array<std::array<double, n>, n> information{};  // lower triangle only
  std::array<double, n> gradient{};

  /// Adds a weighted residual. `row` holds its derivatives with respect to the unknowns, as a
  /// std::array or an Eigen vector.
  template <typename Row>
  void add_residual_row(const Row& row, double residual, double weight = 1) {
    const double* const slope = row.data();
    for (std::size_t i = 0; i < n; ++i) {
      const double weighted = weight * slope[i];
      for (std::size_t k = 0; k <= i; ++k) information[i][k] += weighted * slope[k];
      gradient[i] += weighted * residual;
    }
  }
};

/// Cholesky factor L of the information matrix A = L L^T, with the inverses of its diagonal.
template <std::size_t n>
struct Cholesky {
  std::array<std::array<double, n>, n> lower;
  std::array<double, n> inverse_diagonal;
  bool is_positive = true;

  explicit Cholesky(const Normal<n>& normal) : lower(normal.information) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k <= i; ++k) {
        double sum = lower[i][k];
        for (std::size_t m = 0; m < k; ++m) sum -= lower[i][m] * lower[k][m];
        if (k < i) {
          lower[i][k] = sum * inverse_diagonal[k];
        } else {
          is_positive = is_positive && sum > 0;
          inverse_diagonal[i] = 1 / std::sqrt(sum);
        }
      }
    }
  }

  /// Returns true if the equations determine all unknowns: A is positive definite, and the smallest
  /// squared diagonal element of L exceeds the largest one times the given ratio. The squared
  /// element of an unknown is its information, given all following unknowns and with the preceding
  /// ones free.
  bool has_full_rank(double min_ratio) const {
    const auto [smallest, largest] =
        std::minmax_element(inverse_diagonal.begin(), inverse_diagonal.end());
    return is_positive && *smallest * *smallest > min_ratio * *largest * *largest;
  }

  /// Solves A y = x and returns y.
  std::array<double, n> solve_system(std::array<double, n> x) const {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < i; ++k) x[i] -= lower[i][k] * x[k];
      x[i] *= inverse_diagonal[i];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; ++k) x[i] -= lower[k][i] * x[k];
      x[i] *= inverse_diagonal[i];
    }
    return x;
  }

  /// Returns column i of the inverse of A.
  std::array<double, n> compute_inverse_column(std::size_t i) const {
    std::array<double, n> unit{};
    unit[i] = 1;
    return solve_system(unit);
  }
};

}  // namespace vlp
