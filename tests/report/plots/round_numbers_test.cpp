// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/plot_parts.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

TEST(RoundDownTo125, ReturnsOneTwoOrFiveTimesPowerOfTen) {
  EXPECT_DOUBLE_EQ(round_down_to_1_2_5(0.9), 0.5);
  EXPECT_DOUBLE_EQ(round_down_to_1_2_5(1), 1);
  EXPECT_DOUBLE_EQ(round_down_to_1_2_5(1.99), 1);
  EXPECT_DOUBLE_EQ(round_down_to_1_2_5(4.9e5), 2e5);
  for (const double exact : {1e-6, 2e-3, 0.05, 0.2, 5.0, 1e4}) {
    EXPECT_DOUBLE_EQ(round_down_to_1_2_5(exact), exact);
  }
}

TEST(List125Series, ReturnsNumbersFromBelowLowerToAboveUpperEnd) {
  EXPECT_THAT(list_1_2_5_series(0.016, 0.158),
              Pointwise(testing::DoubleEq(), {0.01, 0.02, 0.05, 0.1, 0.2}));
  EXPECT_THAT(list_1_2_5_series(0.5, 10),
              Pointwise(testing::DoubleEq(), {0.5, 1.0, 2.0, 5.0, 10.0}));
  EXPECT_THAT(list_1_2_5_series(0.2, 0.2),
              ElementsAre(DoubleNear(0.2, 1e-12), DoubleNear(0.5, 1e-12)));
}

}  // namespace
}  // namespace vlp
