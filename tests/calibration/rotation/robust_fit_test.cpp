// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/robust_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "calibration/ceres_solve.h"
#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Residual that cannot be computed.
struct NoResidual {
  template <typename T>
  bool operator()(const T*, T*) const {
    return false;
  }
};

TEST(SolveWithCeres, WritesNothingIfResidualsCannotBeComputed) {
  double value = 0;
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<NoResidual, 1, 1>(new NoResidual),
                           nullptr, &value);
  testing::internal::CaptureStderr();
  EXPECT_FALSE(solve_with_ceres({}, problem));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

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
    const Eigen::Vector2d seen = point + 0.01 * Eigen::Vector2d{random.normal(), random.normal()};
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
    const Eigen::Vector2d seen = point + 0.1 * Eigen::Vector2d{random.normal(), random.normal()};
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
  EXPECT_EQ(at->inverse, Eigen::MatrixXd(at->inverse.transpose()));
}

/// Distance of a point from an observed one.
struct ObservedPoint {
  Eigen::Vector2d seen;

  template <typename T>
  bool operator()(const T* point, T* residual) const {
    residual[0] = point[0] - seen.x();
    residual[1] = point[1] - seen.y();
    return true;
  }
};

void add_observed_point(RobustFit& fit, const Eigen::Vector2d& seen, double* point) {
  fit.add_residual_block(
      std::make_unique<ceres::AutoDiffCostFunction<ObservedPoint, 2, 2>>(new ObservedPoint{seen}),
      {point});
}

/// Adds points that are equally spaced on a circle about (3, -2).
void add_points_on_circle(RobustFit& fit, int count, double radius, double* point) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    add_observed_point(fit, {3 + radius * std::cos(angle), -2 + radius * std::sin(angle)}, point);
  }
}

/// Bound of a residual for 4.5 standard deviations that the median of the squared residuals
/// estimates: quantile of the F distribution, with (ln 2)^2 of the degrees of freedom.
double compute_expected_bound(double median, double rows, double freedom) {
  const double sd = median / std::sqrt(2 * std::log(2.)) * std::sqrt(rows / freedom);
  const double m = std::pow(std::log(2.), 2) * freedom;
  return sd * std::sqrt(m * (std::exp(4.5 * 4.5 / m) - 1));
}

/// Two opposite points far from the others leave the mean unchanged.
TEST(RobustFit, RejectsResidualsBeyondBoundOfMedianResidual) {
  // With all points and without the far ones.
  const double smaller = compute_expected_bound(0.1, 28, 26),
               larger = compute_expected_bound(0.1, 24, 22);
  ASSERT_LT(smaller, larger);
  for (const double distance : {0.98 * smaller, 1.02 * larger}) {
    std::array<double, 2> point{2.9, -1.9};
    RobustFit fit(false);
    add_observed_point(fit, {3 + distance, -2}, point.data());
    add_points_on_circle(fit, 12, 0.1, point.data());
    add_observed_point(fit, {3 - distance, -2}, point.data());
    ASSERT_TRUE(fit.solve_robust_fit());
    EXPECT_NEAR(point[0], 3, 1e-9);
    EXPECT_NEAR(point[1], -2, 1e-9);
    std::vector<bool> expected(14, true);
    if (distance > larger) expected.front() = expected.back() = false;
    EXPECT_EQ(fit.residual_inlier_flags(), expected) << distance;
    EXPECT_EQ(fit.degrees_of_freedom(), distance > larger ? 22 : 26);
    ASSERT_EQ(fit.residual_norms().size(), 14U);
    EXPECT_NEAR(fit.residual_norms()[0], distance, 1e-9);
    EXPECT_NEAR(fit.residual_norms()[5], 0.1, 1e-9);
    EXPECT_NEAR(fit.residual_norms()[13], distance, 1e-9);
  }
}

TEST(RobustFit, KeepsResidualsWithin4Point5SdsOfStatedNoise) {
  for (const bool noise_is_stated : {true, false}) {
    for (const double distance : {4.4, 4.6}) {
      std::array<double, 2> point{3.1, -1.8};
      RobustFit fit(noise_is_stated);
      add_points_on_circle(fit, 12, 0.01, point.data());
      add_observed_point(fit, {3 + distance, -2}, point.data());
      add_observed_point(fit, {3 - distance, -2}, point.data());
      ASSERT_TRUE(fit.solve_robust_fit());
      std::vector<bool> expected(14, true);
      if (!noise_is_stated || distance > 4.5) expected[12] = expected[13] = false;
      EXPECT_EQ(fit.residual_inlier_flags(), expected) << distance;
    }
  }
}

/// Residuals of exact points are rounding errors, below 1e-6.
TEST(RobustFit, ToleratesRoundingOfExactPointsAndRejectsLargerResiduals) {
  std::array<double, 2> point{0, 0};
  RobustFit fit(false);
  add_points_on_circle(fit, 12, 1e-12, point.data());
  add_observed_point(fit, {3 + 2e-6, -2}, point.data());
  add_observed_point(fit, {3 + 1e-2, -2}, point.data());
  ASSERT_TRUE(fit.solve_robust_fit());
  std::vector<bool> expected(14, true);
  expected[13] = false;
  EXPECT_EQ(fit.residual_inlier_flags(), expected);
  EXPECT_NEAR(point[0], 3 + 2e-6 / 13, 1e-9);
  EXPECT_NEAR(fit.residual_norms()[13], 1e-2 - 2e-6 / 13, 1e-9);
}

TEST(RobustFit, RefinedFitIsMeanOfInliersOnly) {
  std::array<double, 2> point{1, 1};
  RobustFit fit(true);
  add_observed_point(fit, {40, 50}, point.data());
  for (int i = 0; i < 9; ++i) add_observed_point(fit, {0.1 * i, 0.02 * i * i}, point.data());
  ASSERT_TRUE(fit.solve_robust_fit());
  EXPECT_NEAR(point[0], 0.4, 1e-9);
  EXPECT_NEAR(point[1], 0.02 * 204 / 9, 1e-9);
  std::vector<bool> expected(10, true);
  expected[0] = false;
  EXPECT_EQ(fit.residual_inlier_flags(), expected);
  EXPECT_NEAR(fit.residual_norms()[0], std::hypot(40 - point[0], 50 - point[1]), 1e-9);
  // From the outlier on, all points are inliers at first.
  point = {40, 50};
  ASSERT_TRUE(fit.refine_fit_without_outliers());
  EXPECT_EQ(fit.residual_inlier_flags(), expected);
  EXPECT_NEAR(point[0], 0.4, 1e-9);
}

TEST(RobustFit, FailsIfResidualIsNotFinite) {
  std::array<double, 2> point{0, 0};
  RobustFit fit(true);
  add_points_on_circle(fit, 4, 1, point.data());
  add_observed_point(fit, {std::numeric_limits<double>::quiet_NaN(), 0}, point.data());
  EXPECT_FALSE(fit.solve_robust_fit());
  RobustFit all_invalid(true);
  add_observed_point(all_invalid, {3, -2}, point.data());
  point[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(all_invalid.solve_robust_fit());
}

/// The first parameter of the list belongs to no residual, the second to a used one.
TEST(RobustFit, FixesFirstParameterThatUsedResidualsDependOn) {
  std::array<double, 2> offset{};
  std::array<double, 4> turns{0, 0.05, 0, 0};
  Random random(4);
  RobustFit fit(true);
  for (std::size_t i = 0; i < 12; ++i) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    const Eigen::Vector2d point(x, y);
    fit.add_residual_block(std::make_unique<ceres::AutoDiffCostFunction<TurnedPoint, 2, 2, 1>>(
                               new TurnedPoint{point, point + Eigen::Vector2d(0.2, 0.1)}),
                           {offset.data(), &turns.at(1 + i % 3)});
  }
  fit.set_first_used_parameter_constant({&turns[0], &turns[1], &turns[2]});
  EXPECT_EQ(fit.degrees_of_freedom(), 24 - 4) << "before the fit";
  ASSERT_TRUE(fit.solve_robust_fit());
  EXPECT_EQ(turns[1], 0.05);
  EXPECT_GT(std::abs(turns[2]), 1e-4);
  EXPECT_EQ(fit.degrees_of_freedom(), 24 - 4);
}

/// Observation of a weighted sum of two parameters with two components each.
struct WeightedSum {
  double first_weight, second_weight;
  Eigen::Vector2d seen;

  template <typename T>
  bool operator()(const T* first, const T* second, T* residual) const {
    for (int i = 0; i < 2; ++i) {
      residual[i] = first_weight * first[i] + second_weight * second[i] - seen[i];
    }
    return true;
  }
};

void add_weighted_sum(RobustFit& fit, const WeightedSum& sum, double* first, double* second) {
  fit.add_residual_block(
      std::make_unique<ceres::AutoDiffCostFunction<WeightedSum, 2, 2, 2>>(new WeightedSum(sum)),
      {first, second});
}

/// Per component, J'J = (6, 1; 1, 14) with the inverse (14, -1; -1, 6) / 83. The outlier counts
/// neither in J'J nor in the variance.
TEST(RobustFit, LinearizationUsesInliersOnly) {
  std::array<double, 2> first{}, second{};
  RobustFit fit(true);
  const std::vector<std::array<double, 2>> weights = {{1, 2}, {1, -3}, {2, 1}};
  for (const auto& [a, b] : weights) {
    const double error = a > 1 ? 0 : 0.5;
    add_weighted_sum(fit, {a, b, {3 * a - 2 * b + error, 4 * a + 5 * b - error}}, first.data(),
                     second.data());
  }
  add_weighted_sum(fit, {1, 1, {500, -700}}, first.data(), second.data());
  add_weighted_sum(fit, {0, 0, {1, 0}}, first.data(), second.data());
  ASSERT_TRUE(fit.solve_robust_fit());
  const std::vector<bool> expected = {true, true, true, false, true};
  ASSERT_EQ(fit.residual_inlier_flags(), expected);
  EXPECT_EQ(fit.degrees_of_freedom(), 8 - 4);
  const auto at = fit.linearize_used_residuals();
  ASSERT_TRUE(at);
  ASSERT_EQ(at->residuals.size(), 4U);
  EXPECT_EQ(at->residuals[2].index, 2U);
  EXPECT_EQ(at->residuals[3].index, 4U);
  EXPECT_EQ(at->first_unknown.at(first.data()), 0);
  EXPECT_EQ(at->first_unknown.at(second.data()), 2);
  Eigen::Matrix<double, 2, 4> jacobian;
  jacobian << 1, 0, -3, 0, 0, 1, 0, -3;
  EXPECT_THAT(at->residuals[1].jacobian, IsNear(jacobian, 1e-12));
  double squares = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    if (i != 3) squares += std::pow(fit.residual_norms()[i], 2);
  }
  EXPECT_GT(squares, 1);
  EXPECT_NEAR(at->variance, squares / 4, 1e-12);
  const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
  EXPECT_THAT(at->covariance(first.data(), first.data()),
              IsNear(Matrix2(at->variance * 14 / 83 * unit), 1e-12));
  EXPECT_THAT(at->covariance(second.data(), second.data()),
              IsNear(Matrix2(at->variance * 6 / 83 * unit), 1e-12));
  EXPECT_THAT(at->covariance(first.data(), second.data()),
              IsNear(Matrix2(-at->variance / 83 * unit), 1e-12));
}

TEST(RobustFit, HasNoLinearizationWithoutRedundancyOrForUndeterminedParameters) {
  std::array<double, 2> first{}, second{};
  RobustFit exact(true);
  add_observed_point(exact, {3, -2}, first.data());
  ASSERT_TRUE(exact.solve_robust_fit());
  EXPECT_EQ(exact.degrees_of_freedom(), 0);
  EXPECT_FALSE(exact.linearize_used_residuals());
  add_observed_point(exact, {3.5, -2}, first.data());
  ASSERT_TRUE(exact.solve_robust_fit());
  EXPECT_TRUE(exact.linearize_used_residuals());
  // Only the sum of both parameters is determined.
  RobustFit sum(true);
  for (int i = 0; i < 4; ++i) add_weighted_sum(sum, {1, 1, {3, i}}, first.data(), second.data());
  ASSERT_TRUE(sum.solve_robust_fit());
  EXPECT_EQ(sum.degrees_of_freedom(), 4);
  EXPECT_FALSE(sum.linearize_used_residuals());
}

}  // namespace
}  // namespace vlp
