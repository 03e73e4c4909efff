// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace vlp {
namespace {

/// 36 captures with errors of 0.05 mm, those of `indices` with 52 mm.
std::vector<CaptureError> errors_with(const std::vector<std::size_t>& indices) {
  std::vector<CaptureError> errors;
  for (int i = 0; i < 36; ++i) {
    errors.push_back({std::to_string(100 + i), 5e-5, static_cast<std::size_t>(i)});
  }
  for (const std::size_t index : indices) errors[index].size = 0.052;
  return errors;
}

TEST(DescribeErrorOutliers, NamesConsecutiveCapturesAsRanges) {
  EXPECT_EQ(describe_error_outliers(errors_with({0, 1, 2, 3, 4})),
            "captures 100 to 104 have errors up to 52.0 mm, the others 0.05 mm: taken at other "
            "positions than those in their table, or by another camera");
  EXPECT_EQ(describe_error_outliers(errors_with({7})),
            "107 was not taken at the position in its table: its error is 52.0 mm, that of others "
            "0.05 mm");
  const std::string many = describe_error_outliers(errors_with({0, 2, 3, 5, 7, 9, 11, 12, 13}));
  EXPECT_EQ(many.substr(0, many.find(" have")),
            "captures 100, 102, 103, 105, 107, 109 and 1 more groups");
}

TEST(DescribeErrorOutliers, ReturnsEmptyTextWithoutGrossOutliers) {
  EXPECT_EQ(describe_error_outliers(errors_with({})), "");
  auto errors = errors_with({});
  errors[3].size = 0.004;
  EXPECT_EQ(describe_error_outliers(errors), "") << "a camera may have it";
  for (CaptureError& error : errors) error.size = 0.05;
  EXPECT_EQ(describe_error_outliers(errors), "") << "all of them";
  EXPECT_EQ(describe_error_outliers({{"a", 1e-5}, {"b", 1}, {"c", 1e-5}}), "") << "too few";
}

TEST(DescribeResidualOutliers, NamesCapturesOnlyWhenAtLeastTwoAreOutliers) {
  std::vector<CaptureError> residuals;
  residuals.reserve(24);
  for (std::size_t i = 0; i < 24; ++i) residuals.push_back({std::to_string(100 + i), 0.02, i});
  EXPECT_EQ(describe_residual_outliers(residuals), "");
  residuals[3].size = 0.5;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "a covered lamp";
  residuals[4].size = 0.19;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "one camera may have it";
  residuals[4].size = 0.3;
  EXPECT_EQ(
      describe_residual_outliers(residuals),
      "the lamps in captures 103, 104 do not fit lens and tilt of the others (residuals up to 0.50 "
      "px, typically 0.02 px): other camera, or covered lamps; repeat these captures");
  for (CaptureError& each : residuals) each.size = 0.3;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "all of them";
}

}  // namespace
}  // namespace vlp
