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
    const double unweighted_rms_px = std::sqrt(truth.variance_px2(sd_px));
    const Eigen::Vector2d residual =
        unweighted_rms_px * Eigen::Vector2d{random.normal(), random.normal()};
    errors.push_back({residual.squaredNorm() / 2, sd_px});
  }
  return errors;
}

TEST(FitCornerVariance, MatchesTrueVarianceOfSimulatedCorners) {
  Random random(1);
  for (const auto& [rest_px, scale] :
       {std::pair{0.02, 1.2}, {0.0, 1.0}, {0.05, 0.0}, {0.2, 1.0}, {0.005, 2.0}}) {
    const CornerVariance truth{rest_px * rest_px, scale * scale};
    const CornerVariance found = fit_corner_variance(simulate_errors(truth, random));
    for (const double sd_px : {0.01, 0.03, 0.1}) {
      EXPECT_NEAR(std::sqrt(found.variance_px2(sd_px) / truth.variance_px2(sd_px)), 1, 0.08)
          << rest_px << " " << scale << " " << sd_px;
    }
  }
}

TEST(FitCornerVariance, MatchesTrueVarianceWithOnePercentOutliers) {
  Random random(2);
  const CornerVariance truth{1e-4, 1};
  auto errors = simulate_errors(truth, random);
  for (std::size_t i = 0; i < errors.size(); i += 100) errors[i].square_px2 = 4;
  const CornerVariance found = fit_corner_variance(errors);
  for (const double sd_px : {0.01, 0.1}) {
    EXPECT_NEAR(std::sqrt(found.variance_px2(sd_px) / truth.variance_px2(sd_px)), 1, 0.15);
  }
}

TEST(FitCornerVariance, ReturnsExactFloorAndScaleForExactSquares) {
  constexpr double floor_px2 = 4e-4, scale2 = 2.25;
  std::vector<CornerError> errors;
  for (const double sd_px : {0.01, 0.02, 0.04, 0.05, 0.08})
    errors.push_back({floor_px2 + scale2 * sd_px * sd_px, sd_px});
  const CornerVariance found = fit_corner_variance(errors);
  EXPECT_NEAR(found.floor_px2, floor_px2, 1e-12);
  EXPECT_NEAR(found.scale2, scale2, 1e-9);
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
          compare_projections(views.lens, solution.fitted_lens(), views.imager_px, even);
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

/// Some corners have no standard deviation and much larger errors than the others.
TEST(CornerWeights, CornersWithoutSdHaveAlmostNoEffectOnLens) {
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
  const auto apart =
      compare_projections(without.fitted_lens(), with.fitted_lens(), views.imager_px, even);
  ASSERT_TRUE(apart);
  EXPECT_LT(apart->rms_px, 0.02);
}

}  // namespace
}  // namespace vlp
