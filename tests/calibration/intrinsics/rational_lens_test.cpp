// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// OPENCV8 and OPENCV12 for boards far off the axis of a wide lens: their rational functions can
/// have poles between the corners.
#include <gtest/gtest.h>

#include "calibration/intrinsics/wide_views.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

class SolveRationalLens : public testing::TestWithParam<LensModel> {};

TEST_P(SolveRationalLens, MatchesTrueLensUpTo78DegreesOffAxis) {
  constexpr int views = 36;
  constexpr double noise_px = 0.05;
  for (const double reach_deg : {69, 80}) {
    Random random(static_cast<std::uint64_t>(reach_deg));
    WideBoards boards;
    boards.reach_rad = rad_from_deg(reach_deg);
    IntrinsicsInput input = wide_input(false, views, random, noise_px, {0, 0}, boards);
    input.lens_model = GetParam();
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded()) << reach_deg;
    EXPECT_EQ(solution.views.size(), views) << reach_deg;
    EXPECT_NEAR(solution.rms_px, noise_px, 0.05 * noise_px) << reach_deg;
    const auto difference = up_to(reach_deg - 2, solution.fitted_lens());
    EXPECT_LT(difference.mean_px, 0.05) << reach_deg;
    EXPECT_LT(difference.worst_px, 0.2) << reach_deg;
  }
}

INSTANTIATE_TEST_SUITE_P(Models, SolveRationalLens,
                         testing::Values(LensModel::opencv8, LensModel::opencv12),
                         [](const auto& instance) {
                           return instance.param == LensModel::opencv8 ? "Opencv8" : "Opencv12";
                         });

}  // namespace
}  // namespace vlp
