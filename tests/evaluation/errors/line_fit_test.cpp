// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/line_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fix_at.h"

namespace vlp {
namespace {

TEST(FitLineToFixes, DistancesOfFittedLineFromCommandedLineExcludeJitter) {
  std::vector<FixRow> fixes;
  for (int i = 0; i <= 100; ++i) {  // along x = 1 - 0.01 + ..., upwards, jitter of 2 mm across
    fixes.push_back(fix_at("", 0.01 + (i % 2 == 0 ? 2e-3 : -2e-3), i / 100.0));
  }
  const auto fit = fit_line_to_fixes(fixes, {Eigen::Vector2d(0, 1), Eigen::Vector2d(0, 0)});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->jitter_m, 2e-3, 1e-6);
  EXPECT_NEAR(fit->distances_m.mean, 10e-3, 1e-4);  // the jitter is gone
  EXPECT_NEAR(fit->distances_m.max, 10e-3, 1e-4);
  EXPECT_NEAR(fit->angle_rad, 0, 1e-4);
  EXPECT_EQ(fit->distances_m.count, kLineSamples);
  EXPECT_NEAR(fit->line_m[0].y(), 1, 1e-4);  // in the order of the commanded line
  EXPECT_NEAR(fit->line_m[1].y(), 0, 1e-4);
}

/// Line through the center of the commanded one, rotated by 0.1: errors grow linearly from 0 to
/// 0.1.
TEST(FitLineToFixes, ReturnsAngleAndDistanceStatisticsOfRotatedLine) {
  std::vector<FixRow> fixes;
  for (int i = -10; i <= 10; ++i) fixes.push_back(fix_at("", i / 10.0, i / 100.0));
  const auto fit = fit_line_to_fixes(fixes, {Eigen::Vector2d(-1, 0), Eigen::Vector2d(1, 0)});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->angle_rad, std::atan(0.1), 1e-9);
  EXPECT_NEAR(fit->distances_m.max, 0.1, 1e-9);
  EXPECT_NEAR(fit->distances_m.median, 0.05, 1e-9);
  EXPECT_NEAR(fit->distances_m.p90, 0.09, 1e-3);
  EXPECT_NEAR(fit->jitter_m, 0, 1e-7);  // the root of rounding
}

TEST(FitLineToFixes, ReturnsLineInDirectionOfCommandedLine) {
  const std::vector<FixRow> fixes{fix_at("", 0, 0), fix_at("", 1, 0)};
  const Eigen::Vector2d begin(0, 0), end(1, 0);
  for (const CommandedLine& line : {CommandedLine{begin, end}, CommandedLine{end, begin}}) {
    const auto fit = fit_line_to_fixes(fixes, line);
    ASSERT_TRUE(fit);
    EXPECT_NEAR((fit->line_m[0] - line[0]).norm(), 0, 1e-12);
    EXPECT_NEAR(fit->angle_rad, 0, 1e-12);
  }
}

TEST(FitLineToFixes, ReturnsNulloptWhenFixesDetermineNoDirection) {
  const CommandedLine line{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0)};
  EXPECT_FALSE(fit_line_to_fixes({fix_at("", 0, 0)}, line));
  EXPECT_FALSE(fit_line_to_fixes({fix_at("", 1, 1), fix_at("", 1, 1)}, line));
  EXPECT_FALSE(fit_line_to_fixes(
      {fix_at("", 0, 0), fix_at("", 1, 1), fix_at("", 0, 1), fix_at("", 1, 0)}, line));
  EXPECT_TRUE(fit_line_to_fixes({fix_at("", 0, 0), fix_at("", 0, 1)}, line));
}

}  // namespace
}  // namespace vlp
