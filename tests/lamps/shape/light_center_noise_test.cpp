// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

/// Returns the score of a scene without its lens: errors relative to the reported sigma.
Score without_lens(const std::string& scene, std::size_t step) {
  const Captures captures(scene, "check");
  DetectorCamera camera = make_detector_camera(captures.calibration());
  camera.lens.reset();
  return captures.score(step, LightDetector(captures.lamps(), camera));
}

TEST(LightDetector, SigmaMatchesCenterErrorsForUnknownLens) {
  for (const auto& [scene, step] :
       {std::pair("paper-rig", 12), {"paper-rig-faulty", 24}, {"wide", 16}}) {
    const Score score = without_lens(scene, std::size_t(step));
    EXPECT_GT(score.lamps, 80) << scene;
    EXPECT_EQ(score.wrong, 0) << scene;
    EXPECT_GT(score.rms_px(), 0.3) << scene << ": there is something to state";
    EXPECT_GT(score.chi_square / score.lamps, 0.3) << scene;
    EXPECT_LT(score.chi_square / score.lamps, 1.5) << scene;
  }
}

}  // namespace
}  // namespace vlp
