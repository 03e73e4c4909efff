// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_figures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

TEST(SummarizeErrors, MatchesManuallyComputedValuesOfTenErrors) {
  const ErrorStatistics statistics = summarize_errors({10, 1, 2, 3, 4, 9, 8, 7, 6, 5});
  EXPECT_EQ(statistics.count, 10);
  EXPECT_DOUBLE_EQ(statistics.mean, 5.5);
  EXPECT_EQ(statistics.median, 5);  // half of ten do not exceed it
  EXPECT_EQ(statistics.p90, 9);
  EXPECT_EQ(statistics.max, 10);
  EXPECT_DOUBLE_EQ(statistics.rms, std::sqrt(38.5));
}

TEST(SummarizeErrors, EachStatisticEqualsSingleError) {
  const ErrorStatistics statistics = summarize_errors({3});
  for (const double figure :
       {statistics.mean, statistics.median, statistics.p90, statistics.max, statistics.rms}) {
    EXPECT_EQ(figure, 3);
  }
}

TEST(SummarizeSignedErrors, ReturnsMeanAsBiasAndMagnitudeStatistics) {
  const SignedErrorStatistics statistics = summarize_signed_errors({-3, 1, -1});
  EXPECT_EQ(statistics.bias, -1);
  EXPECT_EQ(statistics.magnitudes.median, 1);
  EXPECT_EQ(statistics.magnitudes.max, 3);
}

TEST(ListPercentiles, Returns100PercentilesWithP90OfErrorStatistics) {
  std::vector<double> errors(200);
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = static_cast<double>(200 - i);
  const auto distribution = list_percentiles(errors);
  ASSERT_EQ(distribution.size(), 100);
  EXPECT_EQ(distribution[0], std::pair(0.01, 2.0));
  EXPECT_EQ(distribution[6], std::pair(0.07, 14.0));  // 0.07 * 200 is a little more than 14
  EXPECT_EQ(distribution[89].second, summarize_errors(errors).p90);
  EXPECT_EQ(distribution[99], std::pair(1.0, 200.0));
}

}  // namespace
}  // namespace vlp
