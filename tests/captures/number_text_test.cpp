// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/number_text.h"

#include <gmock/gmock.h>

#include <limits>

namespace vlp {
namespace {

TEST(NumberText, FormatFunctionsReturnRequestedNumberOfDigits) {
  EXPECT_EQ(format_fixed_decimals(1.0 / 3, 4), "0.3333");
  EXPECT_EQ(format_fixed_decimals(-2e-12, 9), "-0.000000000");
  EXPECT_EQ(format_digits(1234.5678, 6), "1234.57");
  EXPECT_EQ(format_digits(1.5e-7, 6), "1.5e-07");
  EXPECT_GT(format_fixed_decimals(std::numeric_limits<double>::max(), 9).size(), 300);
}

}  // namespace
}  // namespace vlp
