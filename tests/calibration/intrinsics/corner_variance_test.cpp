// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Variances of corners from their residuals, and lenses from corners of different variances.
#include "calibration/intrinsics/corner_variance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

/// Returns errors of corners with standard deviations from pixel noise of 0.01 to 0.1 px.
std::vector<CornerError> simulate_errors(const CornerVariance& truth, Random& random) {
  std::vector<CornerError> errors;
  for (int i = 0; i < 4000; ++i) {
    const double sd_px = 0.01 * std::pow(10, random.uniform(0, 1));
    const double unweighted_rms_px = std::sqrt(truth.corner_variance_px2(sd_px));
    const Eigen::Vector2d residual =
        unweighted_rms_px * Eigen::Vector2d{random.normal(), random.normal()};
    errors.push_back({residual.squaredNorm() / 2, sd_px});
  }
  return errors;
}

TEST(EstimateCornerVarianceComponents, MatchesTrueVarianceOfSimulatedCorners) {
  Random random(1);
  for (const auto& [rest_px, scale] :
       {std::pair{0.02, 1.2}, {0.0, 1.0}, {0.05, 0.0}, {0.2, 1.0}, {0.005, 2.0}}) {
    const CornerVariance truth{rest_px * rest_px, scale * scale};
    const CornerVariance found =
        estimate_corner_variance_floor_and_scale(simulate_errors(truth, random));
    for (const double sd_px : {0.01, 0.03, 0.1}) {
      EXPECT_NEAR(std::sqrt(found.corner_variance_px2(sd_px) / truth.corner_variance_px2(sd_px)), 1,
                  0.08)
          << rest_px << " " << scale << " " << sd_px;
    }
  }
}

TEST(EstimateCornerVarianceComponents, MatchesTrueVarianceWithOnePercentOutliers) {
  Random random(2);
  const CornerVariance truth{1e-4, 1};
  auto errors = simulate_errors(truth, random);
  for (std::size_t i = 0; i < errors.size(); i += 100) errors[i].square_px2 = 4;
  const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
  for (const double sd_px : {0.01, 0.1}) {
    EXPECT_NEAR(std::sqrt(found.corner_variance_px2(sd_px) / truth.corner_variance_px2(sd_px)), 1,
                0.15);
  }
}

TEST(EstimateCornerVarianceComponents, MatchesTrueVarianceWhenOneSdIsTooLarge) {
  Random random(2);
  const CornerVariance truth{1e-4, 1};
  for (const double sd_px : {0.5, 1.0, 1e9}) {
    auto errors = simulate_errors(truth, random);
    errors[3].sd_px = sd_px;
    const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
    for (const double known_px : {0.01, 0.1}) {
      EXPECT_NEAR(
          std::sqrt(found.corner_variance_px2(known_px) / truth.corner_variance_px2(known_px)), 1,
          0.08)
          << sd_px;
    }
  }
}

TEST(EstimateCornerVarianceComponents, ReturnsMeanSquareErrorWhenAllSdsAreEqual) {
  const std::vector<CornerError> errors{{4e-4, 0.01}, {1e-4, 0.01}, {1e-4, 0.01}};
  EXPECT_NEAR(estimate_corner_variance_floor_and_scale(errors).corner_variance_px2(0.01), 2e-4,
              1e-9);
}

TEST(EstimateCornerVarianceComponents, ReturnsExactFloorAndScaleForExactSquares) {
  constexpr double floor_px2 = 4e-4, scale2 = 2.25;
  std::vector<CornerError> errors;
  for (const double sd_px : {0.01, 0.02, 0.04, 0.05, 0.08})
    errors.push_back({floor_px2 + scale2 * sd_px * sd_px, sd_px});
  const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
  EXPECT_NEAR(found.floor_px2, floor_px2, 1e-12);
  EXPECT_NEAR(found.scale2, scale2, 1e-9);
}

TEST(EstimateCornerVarianceComponents, FloorIsAtLeast2Per1000OfMeanSquare) {
  std::vector<CornerError> errors;
  double mean_px2 = 0;
  for (const double sd_px : {0.5, 1.0, 2.0, 3.0}) {
    errors.push_back({2.25 * sd_px * sd_px, sd_px});
    mean_px2 += 2.25 * sd_px * sd_px / 4;
  }
  const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
  EXPECT_NEAR(found.floor_px2, 0.002 * mean_px2, 1e-9);
  EXPECT_NEAR(found.scale2, 2.25, 1e-9);
}

/// The weighted line through these squares has a negative intercept; the estimate is the weighted
/// proportionality factor.
TEST(EstimateCornerVarianceComponents, ReturnsScaleOnlyIfFloorWouldBeNegative) {
  const std::vector<CornerError> errors{{0.5, 1}, {7.5, 2}, {0.6, 1}, {7, 2}, {25, 4}};
  const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
  double products = 0, squares = 0, mean_px2 = 0;
  for (const auto& [square_px2, sd_px] : errors) {
    const double weight = std::pow(found.corner_variance_px2(sd_px), -2);
    products += weight * square_px2 * sd_px * sd_px;
    squares += weight * std::pow(sd_px, 4);
    mean_px2 += square_px2 / 5;
  }
  EXPECT_NEAR(found.scale2, products / squares, 1e-6);
  EXPECT_GT(found.scale2, 0.5);
  EXPECT_NEAR(found.floor_px2, 0.002 * mean_px2, 1e-9);
}

TEST(EstimateCornerVarianceComponents, ReturnsFloorOnlyIfSquaresDecreaseWithSd) {
  const CornerVariance found =
      estimate_corner_variance_floor_and_scale(std::vector<CornerError>{{8, 1}, {6, 1}, {1, 2}});
  EXPECT_NEAR(found.floor_px2, 5, 1e-9);
  EXPECT_EQ(found.scale2, 0);
}

/// The variance v of 99 squares of 1 and an outlier that counts as 9 variances is
/// (99 + 9 v) / 100.
TEST(EstimateCornerVarianceComponents, CountsOutlierAsThreeSigmas) {
  std::vector<CornerError> errors(99, {1, 1});
  errors.push_back({1e6, 1});
  const CornerVariance found = estimate_corner_variance_floor_and_scale(errors);
  EXPECT_NEAR(found.corner_variance_px2(1), 99. / 91, 1e-8);
  const CornerWeights weights(errors, {});
  EXPECT_NEAR(weights.corner_weight(1), 1, 1e-8);
  EXPECT_NEAR(weights.corner_weight(0), 1, 1e-8);
}

TEST(EstimateCornerVarianceComponents, ReturnsMeanSquareIfAllSdsAreZero) {
  const CornerVariance found =
      estimate_corner_variance_floor_and_scale(std::vector<CornerError>{{1, 0}, {2, 0}, {6, 0}});
  EXPECT_NEAR(found.floor_px2, 3, 1e-9);
  EXPECT_EQ(found.scale2, 0);
}

TEST(EstimateCornerVarianceComponents, ReturnsMeanSquareIfMostSquaresAreZero) {
  const CornerVariance found = estimate_corner_variance_floor_and_scale(
      std::vector<CornerError>{{0, 1}, {0, 1}, {0, 1}, {4, 1}});
  EXPECT_NEAR(found.corner_variance_px2(1), 1, 1e-9);
}

TEST(EstimateCornerVarianceComponents, ReturnsExactVarianceIfMostSdsAreZero) {
  const CornerVariance found = estimate_corner_variance_floor_and_scale(
      std::vector<CornerError>{{1, 0}, {1, 0}, {1, 0}, {3, 0.5}});
  EXPECT_NEAR(found.floor_px2, 1, 1e-9);
  EXPECT_NEAR(found.scale2, 8, 1e-7);
}

/// Returns corners of 16 views with known standard deviations, ten times as large at the rim of the
/// image as in its middle. Edges do not shift, so that the priors of shifts are not tested as well.
IntrinsicsInput uneven_input(const SyntheticViews& views, Random& random) {
  IntrinsicsInput input = views.input(16, random, 0);
  input.warp = WarpChoice::off;
  for (auto& view : input.views) {
    for (auto& corner : view) {
      const double off = (corner.pixel - Eigen::Vector2d(400, 300)).norm() / 500;
      corner.d_pixel_d_edge_shift.setZero();
      corner.sd_px = 0.01 * std::exp(3 * off);
      corner.pixel += corner.sd_px * Eigen::Vector2d{random.normal(), random.normal()};
    }
  }
  return input;
}

/// Returns the unweighted RMS residual per axis of the corners that are not outliers.
double unweighted_rms_px(const IntrinsicsSolution& solution) {
  double squares = 0, count = 0;
  const auto residuals = compute_reprojection_residuals(solution.problem);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (!(solution.problem.points[i].z() > 0)) continue;
    squares += residuals[i].squaredNorm();
    count += 2;
  }
  return std::sqrt(squares / count);
}

/// Compares solves with and without known standard deviations.
TEST(CornerWeights, KnownCornerSdsReduceProjectionErrorOfSolve) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  double known_px2 = 0, unknown_px2 = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    IntrinsicsInput input = uneven_input(views, random);
    const auto square_px2 = [&] {
      const IntrinsicsSolution solution = solve_intrinsics(input);
      EXPECT_TRUE(solution.has_succeeded());
      const auto difference =
          compute_projection_difference(views.lens, solution.fitted_lens(), views.imager_px, even);
      return std::pow(difference.value().rms_px, 2);
    };
    known_px2 += square_px2();
    for (auto& view : input.views) {
      for (auto& corner : view) corner.sd_px = 0;
    }
    unknown_px2 += square_px2();
  }
  EXPECT_LT(std::sqrt(known_px2 / unknown_px2), 0.85);
  RecordProperty("told_over_untold", std::to_string(std::sqrt(known_px2 / unknown_px2)));
}

TEST(CornerWeights, WeightedRmsOfSolutionMatchesUnweightedResidualRms) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  const IntrinsicsSolution solution = solve_intrinsics(uneven_input(views, random));
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_NEAR(solution.rms_px, unweighted_rms_px(solution), 0.05 * unweighted_rms_px(solution));
}

/// Some corners have no standard deviation and much larger errors than the others.
TEST(CornerWeights, SolvedLensHardlyChangesByErroneousCornersWithoutSd) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(4);
  IntrinsicsInput input = uneven_input(views, random);
  const IntrinsicsSolution without = solve_intrinsics(input);
  int unknown = 0;
  for (auto& view : input.views) {
    for (std::size_t i = 0; i < view.size(); i += 25, ++unknown) {
      view[i].sd_px = 0;
      view[i].pixel += 0.5 * Eigen::Vector2d{random.normal(), random.normal()};
    }
  }
  const IntrinsicsSolution with = solve_intrinsics(input);
  ASSERT_TRUE(without.has_succeeded() && with.has_succeeded());
  EXPECT_LT(with.outliers, without.outliers + unknown / 4);
  const auto apart = compute_projection_difference(without.fitted_lens(), with.fitted_lens(),
                                                   views.imager_px, even);
  ASSERT_TRUE(apart);
  EXPECT_LT(apart->rms_px, 0.02);
}

TEST(CornerWeights, WeightsAreInverseToSdsAndKeepMeanSquaredError) {
  Random random(5);
  const CornerVariance truth{1e-4, 1};
  const auto known = simulate_errors(truth, random);
  const CornerWeights weights(known, {});
  EXPECT_NEAR(weights.corner_weight(0.01) / weights.corner_weight(0.1),
              std::sqrt(truth.corner_variance_px2(0.1) / truth.corner_variance_px2(0.01)), 0.3);
  double squares = 0, weighted = 0;
  for (const auto& [square_px2, sd_px] : known) {
    squares += square_px2;
    weighted += std::pow(weights.corner_weight(sd_px), 2) * square_px2;
  }
  EXPECT_NEAR(std::sqrt(weighted / squares), 1, 0.03);
  // A few corners without a deviation that fit by chance get no larger weight than the others.
  const std::vector<CornerError> unknown{{1e-8, 0}, {2e-8, 0}};
  EXPECT_LT(CornerWeights(known, unknown).corner_weight(0), weights.corner_weight(0.01));
}

/// The known corners have the variance 1 + 2 sd^2, so that their mean square is 6.
TEST(CornerWeights, WeightIsRootOfMeanSquareOverVariance) {
  const std::vector<CornerError> known{{3, 1}, {9, 2}};
  const CornerWeights weights(known, {});
  EXPECT_NEAR(weights.corner_weight(1), std::sqrt(6. / 3), 1e-8);
  EXPECT_NEAR(weights.corner_weight(2), std::sqrt(6. / 9), 1e-8);
  EXPECT_NEAR(weights.corner_weight(3), std::sqrt(6. / 19), 1e-8);
  EXPECT_NEAR(weights.corner_weight(0), 1, 1e-8);
  const std::vector<CornerError> inaccurate{{10, 0}, {20, 0}, {42, 0}}, accurate{{1, 0}, {2, 0}},
      exact{{0, 0}, {0, 0}};
  EXPECT_NEAR(CornerWeights(known, inaccurate).corner_weight(0), std::sqrt(6. / 24), 1e-8);
  EXPECT_NEAR(CornerWeights(known, inaccurate).corner_weight(2), std::sqrt(6. / 9), 1e-8);
  EXPECT_NEAR(CornerWeights(known, accurate).corner_weight(0), 1, 1e-8);
  EXPECT_NEAR(CornerWeights(known, exact).corner_weight(0), 1, 1e-8);
}

}  // namespace
}  // namespace vlp
