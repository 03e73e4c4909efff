// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Detection by cameras with a mosaic of color filters.
#include <tuple>
#include <utility>

#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

Score score_behind_filters(const std::string& name, std::size_t step) {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/" + name + "/scene.yaml");
  scene.processing = ImageProcessing{1, {}, {}, Bayer{0.6, 0.55}};
  return Captures(std::move(scene), "check").score(step);
}

TEST(LightDetector, LocatesDiscsAccuratelyInRawBayerImages) {
  for (const auto& [scene, step, max_missed] : {std::tuple("paper-rig", 12, 0), {"wide", 16, 4}}) {
    const Score score = score_behind_filters(scene, std::size_t(step));
    EXPECT_GT(score.lamps, 90) << scene;
    EXPECT_LE(score.missed, max_missed) << scene;
    EXPECT_EQ(score.wrong, 0) << scene;
    EXPECT_LT(score.rms_px(), 0.06) << scene;
    EXPECT_LT(score.chi_square / score.lamps, 1.5) << scene;
  }
}

TEST(LightDetector, LocatesPanelsAndTubesAccuratelyInRawBayerImages) {
  const Score score = score_behind_filters("panels", 11);
  EXPECT_GT(score.lamps, 85);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.35);
  EXPECT_LT(score.chi_square / score.lamps, 1.5);
}

}  // namespace
}  // namespace vlp
