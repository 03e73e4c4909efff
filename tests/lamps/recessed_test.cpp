// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Sources deep in reflectors, seen from 15 to 60 degrees off the vertical: a part of each rim is
/// below the noise.
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

TEST(RecessedLamps, AreIdentifiedWithTheErrorsThatAreStated) {
  int lamps = 0, missed = 0, wrong = 0, confused = 0;
  double chi_square = 0;
  for (const char* folder : {"near", "aside", "far-aside"}) {
    const Score score = Captures("recessed", folder).score(3);
    lamps += score.lamps;
    missed += score.missed;
    wrong += score.wrong;
    confused += score.confused;
    chi_square += score.chi_square;
  }
  EXPECT_GT(lamps, 90);
  EXPECT_EQ(confused, 0);
  EXPECT_LE(wrong, 0.02 * lamps) << "of some rims another circle is clearer";
  EXPECT_LT(missed, 0.2 * lamps) << "a quarter of the lamps shows less than 2.5 periods";
  EXPECT_GT(chi_square / lamps, 0.5);
  EXPECT_LT(chi_square / lamps, 1.5);
}

}  // namespace
}  // namespace vlp
