// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/plot_parts.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::ElementsAre;

TEST(ComputeThinningStep, ReturnsSmallestStepThatKeepsAtMostLimit) {
  EXPECT_EQ(compute_thinning_step(0, 10), 1u);
  EXPECT_EQ(compute_thinning_step(10, 10), 1u);
  EXPECT_EQ(compute_thinning_step(11, 10), 2u);
  EXPECT_EQ(compute_thinning_step(101, 10), 11u);
  EXPECT_EQ(describe_thinning(10, 1), "");
  EXPECT_EQ(describe_thinning(20, 2), "every 2nd of 20 drawn");
  EXPECT_EQ(describe_thinning(101, 11), "every 11th of 101 drawn");
  EXPECT_EQ(describe_thinning(230, 23), "every 23rd of 230 drawn");
}

TEST(ThinOutIndices, ReturnsAscendingIndicesOfEveryNthAndLargest) {
  const std::vector<double> values = {1, 9, 2, 3, 9, 8, 0};
  EXPECT_THAT(thin_out_indices(values, 3, 2), ElementsAre(0, 1, 3, 4, 6));
  EXPECT_THAT(thin_out_indices(values, 3, 0), ElementsAre(0, 3, 6));
  EXPECT_THAT(thin_out_indices({}, 3, 2), ElementsAre());
}

}  // namespace
}  // namespace vlp
