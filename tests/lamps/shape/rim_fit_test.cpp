// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rim_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/random.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

const Vector2d kShift(0.21, -0.13);

/// Returns pieces of a circle that is displaced by kShift and too small. It is bright on one side,
/// where pieces are more precise.
std::vector<RimPiece> pieces_of_circle(int count, double noise, Random& random) {
  std::vector<RimPiece> pieces;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const Vector2d inwards(-std::cos(angle), -std::sin(angle));
    const double sd_px = 0.1 - 0.06 * std::cos(angle);
    const double error_px = noise * sd_px * random.normal();
    pieces.push_back({inwards, inwards.dot(kShift) - 0.3 + error_px, sd_px});
  }
  return pieces;
}

TEST(EstimateOutlineOffset, ReturnsExactOffsetWithoutNoise) {
  Random random(1);
  for (const bool round : {true, false}) {
    const auto shift = estimate_outline_offset(pieces_of_circle(12, 0, random), round);
    ASSERT_TRUE(shift);
    EXPECT_LT((shift->offset_px - kShift).norm(), 1e-9);
    EXPECT_NEAR(shift->num_inliers, 12, 1e-6);
  }
}

TEST(EstimateOutlineOffset, OffsetCovarianceMatchesScatter) {
  constexpr int draws = 4000;
  Random random(2);
  for (const bool round : {true, false}) {
    for (const double noise : {1.0, 3.0}) {
      double squares = 0, stated = 0;
      for (int i = 0; i < draws; ++i) {
        const auto shift = estimate_outline_offset(pieces_of_circle(24, noise, random), round);
        ASSERT_TRUE(shift);
        squares += (shift->offset_px - kShift).squaredNorm();
        stated += shift->covariance.trace();
      }
      // A scatter below the given standard deviations does not reduce the covariance.
      EXPECT_NEAR(squares / stated, noise == 1 ? 0.9 : 1.15, 0.2) << round << ", " << noise;
    }
  }
}

TEST(EstimateOutlineOffset, OffsetIsAccurateDespiteOneOutlierPiece) {
  Random random(3);
  auto pieces = pieces_of_circle(14, 1, random);
  pieces[3].step_depth_px += 2;
  const auto shift = estimate_outline_offset(pieces, true);
  ASSERT_TRUE(shift);
  EXPECT_LT((shift->offset_px - kShift).norm(), 4 * std::sqrt(shift->covariance.trace()));
  EXPECT_LT(shift->num_inliers, 13);
}

TEST(EstimateOutlineOffset, ReturnsNulloptForTooFewPieces) {
  Random random(4);
  EXPECT_FALSE(estimate_outline_offset(pieces_of_circle(4, 1, random), true));
  EXPECT_FALSE(estimate_outline_offset(pieces_of_circle(6, 1, random), false));
  EXPECT_FALSE(estimate_outline_offset({}, true));
}

}  // namespace
}  // namespace vlp
