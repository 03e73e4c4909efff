// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Recessed downlights as a phone shows them: a source deep in a reflector, lit ten to one and
/// more, a halo, a tone curve, sharpening, JPEG.
#include "detection/rendered_captures.h"

namespace vlp {
namespace {

TEST(Downlights, AreFoundByTheirRims) {
  const Score score = Captures("downlights", "check").score(1);
  EXPECT_GE(score.lamps, 154);  // measured: 157 of 160 wholly in view
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.25);
  EXPECT_LT(score.worst_px, 1);
  EXPECT_LT(score.chi_square / score.lamps, 1.5) << "sigma_px bears the errors out";
}

}  // namespace
}  // namespace vlp
