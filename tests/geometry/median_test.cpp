// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/median.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

TEST(Median, BothMediansReturnMiddleOfOddNumberOfValues) {
  EXPECT_EQ(upper_median({7}), 7);
  EXPECT_EQ(lower_median({7}), 7);
  EXPECT_EQ(upper_median({9, -1, 4}), 4);
  EXPECT_EQ(lower_median({9, -1, 4}), 4);
}

TEST(Median, UpperMedianIsUpperAndLowerMedianIsLowerMiddleValue) {
  EXPECT_EQ(upper_median({3, 1}), 3);
  EXPECT_EQ(lower_median({3, 1}), 1);
  EXPECT_EQ(upper_median({4, 1, 3, 2}), 3);
  EXPECT_EQ(lower_median({4, 1, 3, 2}), 2);
}

}  // namespace
}  // namespace vlp
