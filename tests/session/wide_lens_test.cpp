// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Failures and warnings for a wide lens with LENSMODEL_OPENCVn.
#include <gmock/gmock.h>

#include "calibration/intrinsics/wide_views.h"
#include "geometry/angles.h"
#include "geometry/polygon.h"
#include "session/lens_step.h"
#include "support/observed_view.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// Views of the board up to `reach_deg` off the axis of a 190-degree lens.
LensInput make_wide_set(double reach_deg, LensModel model) {
  constexpr std::size_t count = 30;
  constexpr double noise_px = 0.05;
  const SyntheticViews views = wide_views(true);
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::automatic};
  input.camera.lens_model = model;
  const BoardLattice lattice(views.board);
  Random random(71);
  WideBoards boards;
  boards.reach_rad = rad_from_deg(reach_deg);
  while (input.observations.images.size() < count) {
    const BoardDetection seen = wide_view(views, random, noise_px, boards);
    if (!has_enough_tags(seen, lattice)) continue;
    input.observations.images.push_back(
        observed({std::to_string(input.observations.images.size()), views.imager_px, seen}));
  }
  return input;
}

TEST(RunLensStepWithWideLens, ProposesFisheyeWhenBoardIsBeyondRaysOfModel) {
  const LensResult result = run_lens_step(make_wide_set(180, LensModel::opencv8), {});
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_THAT(result.message, AllOf(HasSubstr("30 views with the board: it is visible up to 10"),
                                    HasSubstr("degrees off axis, where " +
                                              std::string(lens_model_name(LensModel::opencv8)) +
                                              " has no rays: use --lens OPENCV_FISHEYE"),
                                    Not(HasSubstr("add views"))));
}

/// Up to 87 degrees: the errors of a lens that passes match the reported ones in the calibrated
/// region.
TEST(RunLensStepWithWideLens, LensErrorsAreWithinThreeSigmasIfGatesPass) {
  constexpr double sigmas = 3;
  int compared = 0;
  for (const double reach_deg : {60, 75, 87}) {
    const LensResult result = run_lens_step(make_wide_set(reach_deg, LensModel::opencv8), {});
    if (!result.has_succeeded()) {
      EXPECT_THAT(result.message, HasSubstr("use --lens OPENCV_FISHEYE"));
      continue;
    }
    if (reach_deg > 60) {
      EXPECT_THAT(result.warnings, Contains(HasSubstr("use --lens OPENCV_FISHEYE")));
      EXPECT_EQ(result.lens.better_model, LensModel::fisheye);
    }
    if (!describe_failed_gates(check_gates(make_lens_gates(), result.metrics)).empty()) continue;
    const auto difference = compare_projections(
        wide_lens(), result.lens.solution.fitted_lens(), kWideImager,
        [&](const Eigen::Vector2d& pixel) {
          return polygon_contains(result.lens.report.region, pixel) ? 1.0 : INFINITY;
        });
    ASSERT_TRUE(difference);
    EXPECT_LE(difference->worst_px, sigmas * result.lens.report.uncertainty_worst_px) << reach_deg;
    ++compared;
  }
  EXPECT_GT(compared, 0);
}

/// OPENCV5 does not fit a lens of this width; detecting this takes seconds.
TEST(RunLensStep, ProposesFisheyeForUnsuitableModelWithoutBlamingBoard) {
  const LensResult result = run_lens_step(make_wide_set(87, LensModel::opencv5), {});
  ASSERT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_THAT(result.message, AllOf(HasSubstr("OPENCV_FISHEYE fits with 0.05 px"),
                                    HasSubstr("use --lens OPENCV_FISHEYE"),
                                    Not(HasSubstr("board.yaml")), Not(HasSubstr("cannot be"))));
}

TEST(RunLensStep, ValidRegionCoversImageWhenModelFits) {
  constexpr int count = 30;
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::automatic};
  input.camera.lens_model = LensModel::opencv8;
  Random random(5);
  for (int i = 0; i < count; ++i) {
    input.observations.images.push_back(
        observed({std::to_string(i), views.imager_px, views.random_view(random, 0.05)}));
  }
  const LensResult result = run_lens_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_FALSE(result.lens.better_model);
  EXPECT_THAT(result.warnings, testing::IsEmpty());
  EXPECT_GT(result.lens.report.region_fraction, 0.95);
}

}  // namespace
}  // namespace vlp
