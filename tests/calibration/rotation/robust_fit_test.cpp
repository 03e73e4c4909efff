// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/robust_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "support/random.h"

namespace vlp {
namespace {

/// Observed point with a common offset and a rotation of its own.
struct TurnedPoint {
  Eigen::Vector2d point, seen;

  template <typename T>
  bool operator()(const T* offset, const T* turn, T* residual) const {
    residual[0] = point.x() - turn[0] * point.y() + offset[0] - seen.x();
    residual[1] = point.y() + turn[0] * point.x() + offset[1] - seen.y();
    return true;
  }
};

/// Returns the covariance of the offset, with the rotations in memory in the given order.
Matrix2 covariance_with(const std::vector<std::size_t>& order) {
  constexpr std::size_t turns = 12;
  std::vector<double> memory(2 * turns + 2, 0.0);
  double* offset = memory.data() + 2 * order[turns];
  Random random(1);
  RobustFit fit(false);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d point(random.uniform(-1, 1), random.uniform(-1, 1));
    const Eigen::Vector2d seen = point + 0.01 * Eigen::Vector2d(random.normal(), random.normal());
    fit.add_residual_block(std::make_unique<ceres::AutoDiffCostFunction<TurnedPoint, 2, 2, 1>>(
                               new TurnedPoint{point, seen}),
                           {offset, memory.data() + 2 * order[random.index(turns)]});
  }
  EXPECT_TRUE(fit.solve_robust_fit());
  const auto at = fit.linearize_used_residuals();
  EXPECT_TRUE(at);
  return at ? at->covariance(offset, offset) : Matrix2(Matrix2::Zero());
}

TEST(RobustFit, CovarianceIsIdenticalForAnyMemoryOrderOfParameters) {
  std::vector<std::size_t> order(13);
  std::iota(order.begin(), order.end(), 0);
  const Matrix2 expected = covariance_with(order);
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    for (std::size_t j = order.size(); j-- > 1;) std::swap(order[j], order[random.index(j + 1)]);
    EXPECT_EQ(covariance_with(order), expected);
  }
}

/// One offset, a rotation that is fixed and two that are free.
TEST(RobustFit, InverseOfNormalEquationsIsExactAndZeroForFixedParameters) {
  std::array<double, 2> offset{};
  std::array<double, 3> turns{};
  Random random(3);
  RobustFit fit(true);
  for (std::size_t i = 0; i < 12; ++i) {
    const Eigen::Vector2d point(random.uniform(-1, 1), random.uniform(-1, 1));
    const Eigen::Vector2d seen = point + 0.1 * Eigen::Vector2d(random.normal(), random.normal());
    fit.add_residual_block(std::make_unique<ceres::AutoDiffCostFunction<TurnedPoint, 2, 2, 1>>(
                               new TurnedPoint{point, seen}),
                           {offset.data(), &turns.at(i % 3)});
  }
  fit.set_parameter_constant(&turns[0]);
  ASSERT_TRUE(fit.solve_robust_fit());
  EXPECT_EQ(turns[0], 0);
  EXPECT_EQ(fit.degrees_of_freedom(), 24 - 4);
  const auto at = fit.linearize_used_residuals();
  ASSERT_TRUE(at);
  ASSERT_EQ(at->residuals.size(), 12U);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(5, 5);
  double squares = 0;
  for (const auto& residual : at->residuals) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        normal(residual.unknowns[std::size_t(i)], residual.unknowns[std::size_t(j)]) +=
            residual.jacobian.col(i).dot(residual.jacobian.col(j));
      }
    }
    squares += std::pow(fit.residual_norms()[residual.index], 2);
  }
  EXPECT_NEAR(at->variance, squares / 20, 1e-12 * squares);
  const Eigen::Index fixed = at->first_unknown.at(&turns[0]);
  std::vector<Eigen::Index> free_unknowns;
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_EQ(at->inverse(i, fixed), 0);
    EXPECT_EQ(at->inverse(fixed, i), 0);
    if (i != fixed) free_unknowns.push_back(i);
  }
  const Eigen::MatrixXd product =
      at->inverse(free_unknowns, free_unknowns) * normal(free_unknowns, free_unknowns);
  EXPECT_LT((product - Eigen::MatrixXd::Identity(4, 4)).cwiseAbs().maxCoeff(), 1e-10);
}

}  // namespace
}  // namespace vlp
