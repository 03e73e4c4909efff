// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Captures with other lights, glare, poor light and occluders. A lamp may be missed if an object
/// hides it, but every reported lamp is correct.
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

class LightDetectorInClutter : public testing::TestWithParam<const char*> {};

TEST_P(LightDetectorInClutter, IdentifiesAllVisibleLampsAndNoWrongOnes) {
  const Score score = Captures("clutter", GetParam()).score(6);
  EXPECT_GE(score.lamps, 20);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_EQ(score.missed, 0);
  EXPECT_LT(score.chi_square / score.lamps, 2.5);
  EXPECT_GE(score.hidden, 15);
  EXPECT_LT(score.hidden_chi_square / score.hidden,
            5);  // includes motion: 1 m/s and 90 degrees per second
}

INSTANTIATE_TEST_SUITE_P(Folders, LightDetectorInClutter,
                         testing::Values("check", "low-light", "saturated", "fast"),
                         [](const auto& folder) {
                           std::string name = folder.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace vlp
