// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/error_propagation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns the covariance of correlated errors: the second is nearly the negative of the first.
MatrixX make_correlated_covariance() {
  MatrixX covariance(3, 3);
  covariance << 4e-4, -3.9e-4, 0, -3.9e-4, 4e-4, 1e-7, 0, 1e-7, 1e-8;
  return covariance;
}

TEST(DifferentiateSolution, ReturnsExactJacobianOfLinearFunctionForAnyCovariance) {
  MatrixX expected(2, 3);
  expected << 1, -2, 30, 0.5, 4, -7;
  const Eigen::Vector2d nominal(3, -1);
  const auto solve = [&](const Eigen::VectorXd& error) {
    return std::optional<Eigen::VectorXd>(nominal + expected * error);
  };
  for (const MatrixX& covariance :
       {make_correlated_covariance(), MatrixX(1e-10 * MatrixX::Identity(3, 3))}) {
    const auto found = differentiate_solution(solve, nominal, covariance);
    ASSERT_TRUE(found);
    EXPECT_THAT(*found, IsNear(expected, 1e-9));
  }
}

TEST(DifferentiateSolution, EvaluatesErrorsWhoseOuterProductsSumToCovariance) {
  std::vector<Eigen::VectorXd> tried;
  const auto solve = [&](const Eigen::VectorXd& error) {
    tried.push_back(error);
    return std::optional<Eigen::VectorXd>(error.head<2>());
  };
  ASSERT_TRUE(differentiate_solution(solve, Eigen::Vector2d(0, 0), make_correlated_covariance()));
  ASSERT_EQ(tried.size(), 3U);
  MatrixX sum = MatrixX::Zero(3, 3);
  for (const Eigen::VectorXd& error : tried) sum += error * error.transpose();
  EXPECT_THAT(sum, IsNear(make_correlated_covariance(), 1e-15));
  EXPECT_NEAR(tried[0][0], 0.02, 1e-15);  // one standard deviation, and the correlated error
  EXPECT_NEAR(tried[0][1], -0.0195, 1e-15);
}

/// Secant over one standard deviation, not the tangent: f = x^2 at x = 1 with sd 0.1.
TEST(DifferentiateSolution, ReturnsSecantOverOneStandardDeviation) {
  const auto solve = [](const Eigen::VectorXd& error) {
    const double x = 1 + error[0];
    return std::optional<Eigen::VectorXd>(Eigen::Vector2d(x * x, 0));
  };
  const auto found =
      differentiate_solution(solve, Eigen::Vector2d(1, 0), 0.01 * MatrixX::Identity(1, 1));
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found)(0, 0), 2.1, 1e-12);
  EXPECT_EQ((*found)(1, 0), 0);
}

/// The solve fails beyond half a standard deviation.
TEST(DifferentiateSolution, RetriesWithSmallerErrorWhenSolveFails) {
  const auto solve = [](const Eigen::VectorXd& error) -> std::optional<Eigen::VectorXd> {
    if (error.norm() > 0.05) return {};
    return Eigen::VectorXd(3 * error);
  };
  const auto found =
      differentiate_solution(solve, Eigen::Vector2d(0, 0), 0.01 * MatrixX::Identity(2, 2));
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, IsNear(3 * Eigen::Matrix2d::Identity(), 1e-12));
}

TEST(DifferentiateSolution, ReturnsNulloptWhenSolveFailsOrCovarianceIsInvalid) {
  const auto nothing = [](const Eigen::VectorXd& error) {
    return error[2] != 0 ? std::nullopt : std::optional<Eigen::VectorXd>(Eigen::Vector2d(0, 0));
  };
  EXPECT_FALSE(
      differentiate_solution(nothing, Eigen::Vector2d(0, 0), make_correlated_covariance()));
  const auto same = [](const Eigen::VectorXd&) {
    return std::optional<Eigen::VectorXd>(Eigen::Vector2d(0, 0));
  };
  MatrixX negative = MatrixX::Identity(3, 3);
  negative(2, 2) = -1;
  EXPECT_FALSE(differentiate_solution(same, Eigen::Vector2d(0, 0), negative));
  EXPECT_FALSE(differentiate_solution(same, Eigen::Vector2d(0, 0), MatrixX::Zero(3, 3)));
  const auto not_finite = [](const Eigen::VectorXd&) {
    return std::optional<Eigen::VectorXd>(Eigen::Vector2d(NAN, 0));
  };
  EXPECT_FALSE(
      differentiate_solution(not_finite, Eigen::Vector2d(0, 0), make_correlated_covariance()));
}

}  // namespace
}  // namespace vlp
