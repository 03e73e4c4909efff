// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A splined lens whose control points end where the board is still seen, or are too few.
#include <gmock/gmock.h>

#include "calibration/intrinsics/wide_views.h"
#include "camera/spline_grid.h"
#include "session/lens_step.h"
#include "support/observed_view.h"

namespace vlp {
namespace {

using testing::HasSubstr;

LensResult solve_with_grid(const SplineGrid& grid) {
  constexpr std::size_t count = 20;
  constexpr double noise_px = 0.05;
  Random random(61);
  const SyntheticViews views = wide_views(false);
  const BoardLattice lattice(views.board);
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::off};
  input.camera.lens_model = splined_lens_model(grid);
  while (input.observations.images.size() < count) {
    const BoardDetection seen = wide_view(views, random, noise_px);
    if (!has_enough_tags(seen, lattice)) continue;
    input.observations.images.push_back(
        observed({std::to_string(input.observations.images.size()) + ".png", kWideImager, seen}));
  }
  return run_lens_step(input, {});
}

TEST(RunLensStep, ProposesWiderSplineGridWhenGridIsTooNarrow) {
  const LensResult result = solve_with_grid({3, 12, 12, 100});
  ASSERT_FALSE(result.has_succeeded());
  EXPECT_THAT(
      result.message,
      HasSubstr(
          "control points of LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=12_Ny=12_fov_x_deg=100 "
          "extend to 50 degrees off axis horizontally and 50 vert"));
  EXPECT_THAT(result.message,
              HasSubstr(": use --lens LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=12_Ny="));
}

TEST(RunLensStep, ProposesSolvableGridWhenGridIsTooWide) {
  constexpr std::size_t count = 12;
  constexpr double noise_px = 0.02;
  Random random(62);
  SyntheticViews views{synthetic_board(false),
                       {LensModel::pinhole, std::array{4600.0, 4600.0, 395.0, 301.0}}};
  const BoardLattice lattice(views.board);
  LensInput input{{}, views.board, "board.yaml", {}, 0, WarpChoice::off};
  while (input.observations.images.size() < count) {
    const BoardDetection seen = views.random_view(random, noise_px);
    if (!lattice.can_determine_pose(seen)) continue;
    input.observations.images.push_back(observed(
        {std::to_string(input.observations.images.size()) + ".png", views.imager_px, seen}));
  }
  input.camera.lens_model = splined_lens_model({3, 10, 10, 350});
  const LensResult result = run_lens_step(input, {});
  ASSERT_FALSE(result.has_succeeded());
  const std::string take =
      " do not cover the field of view, 5 degrees off axis horizontally and 4 vertically: use "
      "--lens ";
  EXPECT_THAT(result.message, HasSubstr("views with the board: the control points of LENSMODEL_"));
  EXPECT_THAT(result.message, HasSubstr(take));
  const auto model =
      lens_model_from_name(result.message.substr(result.message.find(take) + take.size()));
  ASSERT_TRUE(model) << result.message;
  input.camera.lens_model = *model;
  EXPECT_TRUE(run_lens_step(input, {}).has_succeeded());
}

}  // namespace
}  // namespace vlp
