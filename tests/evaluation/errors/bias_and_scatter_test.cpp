// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_figures.h"

#include <gmock/gmock.h>

#include <cmath>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Two reference points with biases of 3 mm and -3 mm along x and fixes 4 mm to either side along
/// y.
TEST(ComputeBiasAndRepeatability, ReturnsTrueBiasAndScatterOfEachReferencePoint) {
  std::vector<FixError> errors;
  for (const std::size_t station : {0U, 1U}) {
    for (const double side : {-4e-3, 4e-3}) {
      errors.push_back({errors.size(), {station == 0 ? 3e-3 : -3e-3, side}, {}, {}, station, 0});
    }
  }
  errors.push_back({4, {1, 1}, {}, {}, 2, 0});  // alone at its reference point
  const auto statistics = compute_bias_and_repeatability(errors, {{"a", {5, 6}, {}, {}}});
  ASSERT_TRUE(statistics);
  ASSERT_EQ(statistics->reference_points.size(), 2);
  EXPECT_EQ(statistics->fixes, 4);
  EXPECT_EQ(statistics->reference_points[0].xy_m, Eigen::Vector2d(5, 6));
  EXPECT_THAT(statistics->reference_points[1].bias_m, IsNear(Eigen::Vector2d(-3e-3, 0), 1e-15));
  EXPECT_NEAR(statistics->reference_points[0].sd_m, std::sqrt(32e-6), 1e-12);
  EXPECT_NEAR(statistics->repeatability_m, std::sqrt(32e-6), 1e-12);
  EXPECT_EQ(statistics->bias_m, 0);  // 9 of bias^2, and 16 that chance puts there
}

TEST(ComputeBiasAndRepeatability, MatchesTrueBiasWhenScatterExceedsIt) {
  Random random(1);
  std::vector<FixError> errors;
  for (std::size_t i = 0; i < 20000; ++i) {
    errors.push_back(
        {i, {1e-3 + 2e-3 * random.normal(), 2e-3 * random.normal()}, {}, {}, i / 4, 0});
  }
  const auto statistics = compute_bias_and_repeatability(errors, {{"a", {0, 0}, {}, {}}});
  ASSERT_TRUE(statistics);
  // Means of four scatter by as much as the bias is; standard errors are 0.02 and 0.03 mm.
  EXPECT_NEAR(statistics->repeatability_m, 2e-3 * std::sqrt(2), 0.06e-3);
  EXPECT_NEAR(statistics->bias_m, 1e-3, 0.1e-3);
}

}  // namespace
}  // namespace vlp
