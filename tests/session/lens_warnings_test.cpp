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

TEST(RunLensStep, WarnsOfSixTenthsButNotThreeTenthsPixelEdgeDisplacement) {
  EXPECT_THAT(run_lens_step(views_with_edges(0.3), {}).warnings, IsEmpty());
  const LensResult result = run_lens_step(views_with_edges(0.6), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, Contains(HasSubstr("0.60 px towards the dark")));
  EXPECT_THAT(result.warnings, Contains(HasSubstr("is tag_spacing of board.yaml right?")));
}

TEST(RunLensStep, WarnsWhenViewsAreTooFewToHoldOut) {
  LensInput input = views_with_edges(0);
  input.held_out = 30;
  EXPECT_THAT(run_lens_step(input, {}).warnings,
              Contains("no view is held out: 20 views are fewer than 30"));
  input.held_out = 10;
  EXPECT_THAT(run_lens_step(input, {}).warnings, IsEmpty());
}

TEST(RunLensStep, ReportsViewsResidualAndWarpOnlyIfItIsEstimated) {
  LensInput input = views_with_edges(0);
  input.camera.id = "unit-7";
  input.camera.row_time_s = 3e-5;
  for (const WarpChoice warp : {WarpChoice::on, WarpChoice::off}) {
    input.warp = warp;
    const LensResult result = run_lens_step(input, {"", "test", "1.2", "", {}});
    ASSERT_TRUE(result.has_succeeded()) << result.message;
    const auto& report = result.calibration.intrinsics_report;
    ASSERT_TRUE(report);
    EXPECT_EQ(report->board_warp_m.has_value(), warp == WarpChoice::on);
    if (report->board_warp_m) {
      EXPECT_NEAR((*report->board_warp_m)[0], 0, 2e-4);
      EXPECT_NEAR((*report->board_warp_m)[1], 0, 2e-4);
    }
    EXPECT_EQ(report->views, 20);
    EXPECT_GT(report->corners, 0);
    EXPECT_EQ(find_metric_value(result.metrics, "rms_px"), report->rms_px);
    EXPECT_EQ(find_metric_value(result.metrics, "views"), 20);
    EXPECT_EQ(find_metric_value(result.metrics, "expected_max_error_px"),
              report->expected_max_error_px);
    EXPECT_TRUE(find_metric_value(result.metrics, "split_half_px"));
    EXPECT_EQ(result.calibration.camera.id, "unit-7");
    EXPECT_EQ(result.calibration.camera.row_time_s, 3e-5);
    ASSERT_EQ(result.calibration.history.size(), 1U);
    EXPECT_EQ(result.calibration.history[0].part, "camera");
    EXPECT_TRUE(result.drawing);
  }
}

TEST(RunLensStep, FailureForFewViewsCountsRejectedImages) {
  LensInput input = views_with_edges(0);
  input.observations.images.resize(2);
  const LensResult few = run_lens_step(input, {});
  EXPECT_EQ(few.failure, StepFailure::undetermined);
  EXPECT_THAT(few.message, testing::Not(HasSubstr("not used: ")));
  input.observations.images[1].reject(RejectionReason::blurred, "is blurred");
  const LensResult rejected = run_lens_step(input, {});
  EXPECT_EQ(rejected.failure, StepFailure::undetermined);
  EXPECT_THAT(rejected.message, HasSubstr("; not used: 1 blurred"));
  for (Observation& image : input.observations.images) {
    image.reject(RejectionReason::blurred, "is blurred");
  }
  const LensResult none = run_lens_step(input, {});
  EXPECT_EQ(none.failure, StepFailure::undetermined);
  EXPECT_THAT(none.message, HasSubstr("2 blurred"));
}

}  // namespace
}  // namespace vlp
