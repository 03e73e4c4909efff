// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Sources deep in reflectors, viewed at 15 to 60 degrees off the vertical: a part of each rim is
/// below the noise.
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

TEST(LightDetector, SigmaMatchesErrorsOfRecessedLamps) {
  // Without a rim the center is that of the lit area, with an error of up to a lamp's radius. The
  // distance between lamps is more than twice as large.
  constexpr double max_error_px = 100;
  int lamps = 0, missed = 0, wrong = 0;
  double chi_square = 0;
  for (const char* folder : {"near", "aside", "far-aside"}) {
    Captures captures("recessed", folder);
    captures.max_error_px = max_error_px;
    const Score score = captures.score(3);
    lamps += score.lamps;
    missed += score.missed;
    wrong += score.wrong;
    chi_square += score.chi_square;
  }
  EXPECT_GT(lamps, 90);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(missed, 0.2 * lamps)
      << "a quarter shows less than 2.5 periods, of which half are missed";
  EXPECT_GT(chi_square / lamps, 0.5);
  EXPECT_LT(chi_square / lamps, 1.5);
}

}  // namespace
}  // namespace vlp
