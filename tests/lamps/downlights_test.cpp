// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Recessed downlights in images of a phone: a source deep in a reflector with a contrast of at
/// least ten to one, a halo, a tone curve, sharpening and JPEG.
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

TEST(LightDetector, LocatesRenderedDownlightsWithRmsErrorBelowTenthOfPixel) {
  const Score score = Captures("downlights", "check").score(1);
  testing::Test::RecordProperty("rms_px", testing::PrintToString(score.rms_px()));
  testing::Test::RecordProperty("worst_px", testing::PrintToString(score.worst_px));
  testing::Test::RecordProperty("chi_square",
                                testing::PrintToString(score.chi_square / score.lamps));
  EXPECT_GE(score.lamps, 159);  // measured: all 160
  EXPECT_LE(score.missed, 1);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.11);
  EXPECT_LT(score.worst_px, 0.5);
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 1.5) << "sigma_px bears the errors out";
  EXPECT_LT(score.worst_ratio, 6.5);
}

}  // namespace
}  // namespace vlp
