// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// LED chips visible through a lamp's diffuser, and a halo on the ceiling around the lamp.
#include <utility>

#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

Score score_with(const std::optional<Chips>& chips, const std::optional<Halo>& halo) {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  for (SceneLamp& lamp : scene.lamps) {
    lamp.glow.chips = chips;
    lamp.glow.halo = halo;
  }
  return Captures(std::move(scene), "check").score(12);
}

void expect_accurate(const Score& score) {
  testing::Test::RecordProperty("rms_px", testing::PrintToString(score.rms_px()));
  testing::Test::RecordProperty("worst_px", testing::PrintToString(score.worst_px));
  testing::Test::RecordProperty("chi_square",
                                testing::PrintToString(score.chi_square / score.lamps));
  EXPECT_GT(score.lamps, 180);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.045);
  EXPECT_LT(score.worst_px, 0.25);
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 1.5);
}

TEST(LightDetector, LocatesLampsWithChipsBehindDiffuserWithinQuarterPixel) {
  expect_accurate(score_with(Chips{0.3, 0.03, 0.02}, std::nullopt));
}

TEST(LightDetector, LocatesLampsWithChipsAndHaloWithinQuarterPixel) {
  expect_accurate(score_with(Chips{0.3, 0.03, 0.02}, Halo{0.03, 0.02}));
}

}  // namespace
}  // namespace vlp
