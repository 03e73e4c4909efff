// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/fix_summary.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

FixRow row(int lamps, double residual_px, double sd_m) {
  return {
      "", "ok",
      FixRow::Fix{{{0, 0, 0}, 0}, Eigen::Vector4d(3 * sd_m, 4 * sd_m, sd_m, 2 * sd_m), residual_px},
      lamps};
}

TEST(SummarizeFixes, ReturnsCountsAndMediansOfFixes) {
  const std::vector<FixRow> rows{row(2, 0, 1),
                                 row(5, 3, 2),
                                 row(3, 1, 3),
                                 {"", "degenerate", {}, 0},
                                 {"", "too_few_lamps", {}, 0},
                                 {"", "degenerate", {}, 0}};
  const FixSummary summary = summarize_fixes(rows);
  EXPECT_EQ(summary.frames, 6);
  EXPECT_EQ(summary.fixes, 3);
  EXPECT_EQ(summary.failures_by_status.at("degenerate"), 2);
  EXPECT_EQ(summary.failures_by_status.at("too_few_lamps"), 1);
  ASSERT_TRUE(summary.statistics);
  EXPECT_EQ(summary.statistics->min_lamps, 2);
  EXPECT_EQ(summary.statistics->max_lamps, 5);
  EXPECT_DOUBLE_EQ(summary.statistics->mean_lamps, 10.0 / 3);
  EXPECT_EQ(summary.statistics->median_residual_px, 1);  // of 3 and 1, the lower
  ASSERT_TRUE(summary.median_sd);
  EXPECT_EQ(summary.median_sd->horizontal_m, 10);
  EXPECT_EQ(summary.median_sd->height_m, 2);
  EXPECT_EQ(summary.median_sd->yaw_rad, 4);
}

TEST(SummarizeFixes, OmitsStatisticsWithoutFixesOrReportedSds) {
  EXPECT_FALSE(summarize_fixes({}).statistics);
  FixRow without_sd = row(3, 1, 1);
  without_sd.fix->sd.reset();
  const FixSummary summary = summarize_fixes({&without_sd, 1});
  EXPECT_TRUE(summary.statistics);
  EXPECT_FALSE(summary.median_sd);
}

}  // namespace
}  // namespace vlp
