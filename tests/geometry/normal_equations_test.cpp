// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/normal_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr std::size_t kUnknowns = 5;
using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

TEST(NormalEquations, SolutionAndInverseMatchWeightedLeastSquares) {
  Random random(11);
  Normal<kUnknowns> normal;
  Matrix information = Matrix::Zero();
  Vector gradient = Vector::Zero();
  for (int i = 0; i < 20; ++i) {
    Vector row;
    for (double& one : row) one = random.uniform(-1, 1);
    const double residual = random.uniform(-1, 1), weight = random.uniform(0.1, 2);
    normal.add_residual_row(row, residual, weight);
    information += weight * row * row.transpose();
    gradient += weight * residual * row;
  }
  const Cholesky<kUnknowns> factor(normal);
  ASSERT_TRUE(factor.has_full_rank(1e-3));
  const auto step = factor.solve_system(normal.gradient);
  EXPECT_THAT(Vector(Vector::Map(step.data())),
              IsNear(Vector(information.inverse() * gradient), 1e-12));
  Matrix inverse;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    inverse.col(Eigen::Index(i)) = Vector::Map(factor.compute_inverse_column(i).data());
  }
  EXPECT_THAT(inverse, IsNear(Matrix(information.inverse()), 1e-12));
}

TEST(Cholesky, HasFullRankReturnsFalseForRankDeficientEquations) {
  Normal<2> normal;
  normal.add_residual_row(std::array{1.0, 1.0}, 0);
  EXPECT_FALSE(Cholesky<2>(normal).has_full_rank(1e-12));  // only the sum is determined
  normal.add_residual_row(std::array{1e-7, 0.0}, 0);
  EXPECT_FALSE(Cholesky<2>(normal).has_full_rank(1e-12));
  normal.add_residual_row(std::array{1e-3, 0.0}, 0);
  EXPECT_TRUE(Cholesky<2>(normal).has_full_rank(1e-12));
}

}  // namespace
}  // namespace vlp
