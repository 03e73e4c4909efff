// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Warnings about lenses that pass.
#include <gmock/gmock.h>

#include "calibration/intrinsics/synthetic_views.h"
#include "session/lens_step.h"
#include "support/observed_view.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// Views of a plain board with edges displaced by `shift_px` towards the dark side.
LensInput views_with_edges(double shift_px) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::automatic};
  input.camera.lens_model = LensModel::opencv8;
  Random random(8);
  for (int i = 0; i < 20; ++i) {
    BoardDetection seen = views.random_view(random, 0.05);
    for (TagDetection& tag : seen.tags) tag = shrunk(tag, shift_px);
    input.observations.images.push_back(observed({std::to_string(i), views.imager_px, seen}));
  }
  return input;
}

TEST(RunLensCalibrationStep, WarnsOfSixTenthsButNotThreeTenthsPixelEdgeDisplacement) {
  EXPECT_THAT(run_lens_calibration_step(views_with_edges(0.3), {}).warnings, IsEmpty());
  const LensResult result = run_lens_calibration_step(views_with_edges(0.6), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, Contains(HasSubstr("0.60 px towards the dark")));
  EXPECT_THAT(result.warnings, Contains(HasSubstr("is tag_spacing of board.yaml right?")));
}

TEST(RunLensCalibrationStep, WarnsWhenViewsAreTooFewToHoldOut) {
  LensInput input = views_with_edges(0);
  input.held_out = 30;
  EXPECT_THAT(run_lens_calibration_step(input, {}).warnings,
              Contains("no view is held out: 20 views are fewer than 30"));
  input.held_out = 10;
  EXPECT_THAT(run_lens_calibration_step(input, {}).warnings, IsEmpty());
}

}  // namespace
}  // namespace vlp
