// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "session/lens_step.h"

namespace vlp {
namespace {

TEST(CheckLens, HoldsEachMetricAgainstItsGate) {
  const std::vector<Metric> metrics{{"rms_px", 0.5}, {"uncertainty_px", 3}, {"halves_px", 0.1}};
  const auto gates = check_lens({0.5, 2, 1}, metrics);
  ASSERT_EQ(gates.size(), 3u);
  EXPECT_TRUE(gates[0].passed) << "at most";
  EXPECT_FALSE(gates[1].passed);
  EXPECT_EQ(gates[1].value, 3);
  EXPECT_TRUE(gates[2].passed);
}

TEST(CheckLens, IsNotMetByWhatIsNotKnown) {
  const auto gates = check_lens({}, {{"rms_px", 0.1}, {"uncertainty_px", 0.1}});
  EXPECT_TRUE(gates[1].passed);
  EXPECT_FALSE(gates[2].passed) << "half of the views do not determine a lens";
}

}  // namespace
}  // namespace vlp
