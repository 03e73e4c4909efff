// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Selection of a lens model by cross-validation.
#include "calibration/intrinsics/lens_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "calibration/intrinsics/wide_views.h"

namespace vlp {
namespace {

constexpr double kNoise_px = 0.05;

IntrinsicsInput seen_through(const Lens& lens, int count) {
  const SyntheticViews views{synthetic_board(false), lens};
  Random random(41);
  return views.input(count, random, kNoise_px);
}

Lens radial_lens() {
  return {LensModel::opencv4, std::array{520.0, 521.0, 402.0, 297.0, -0.25, 0.08, 0.0002, -0.0001}};
}

/// Returns a lens with a denominator that no polynomial of OPENCV5 approximates.
Lens rational_lens() {
  return {LensModel::opencv8, std::array{420.0, 421.0, 402.0, 297.0, 0.9, 0.25, 0.0002, -0.0001,
                                         0.01, 1.25, 0.5, 0.06}};
}

Lens fisheye_lens() {
  return {LensModel::fisheye, std::array{290.0, 291.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006}};
}

double find_rms(const LensChoice& choice, LensModel model) {
  const auto found =
      std::find_if(choice.candidates.begin(), choice.candidates.end(),
                   [model](const LensCandidate& tried) { return tried.model == model; });
  return found == choice.candidates.end() ? INFINITY : found->rms_px;
}

void expect_chosen(const Lens& lens) {
  constexpr int count = 30;
  const auto choice = select_lens_model(InitialSolutions(seen_through(lens, count)));
  ASSERT_TRUE(choice);
  EXPECT_EQ(lens_model_name(choice->model), lens_model_name(lens.lens_model()))
      << describe_lens_choice(*choice);
  // Noise, and errors outside the region of the other views.
  EXPECT_NEAR(find_rms(*choice, choice->model), kNoise_px, 0.25 * kNoise_px);
  EXPECT_EQ(choice->candidates.size(), 5U);
  EXPECT_TRUE(describe_lens_choice(*choice).starts_with(lens_model_name(lens.lens_model())))
      << describe_lens_choice(*choice);
}

TEST(SelectLensModel, ReturnsOpencv4ForRadialLens) { expect_chosen(radial_lens()); }

TEST(SelectLensModel, ReturnsOpencv8ForRationalLens) { expect_chosen(rational_lens()); }

TEST(SelectLensModel, ReturnsFisheyeForFisheyeLens) { expect_chosen(fisheye_lens()); }

TEST(SelectLensModel, ReturnsRationalModelDespiteOneBadView) {
  constexpr int count = 36;
  IntrinsicsInput input = seen_through(rational_lens(), count);
  for (auto& corner : input.views[5]) {
    corner.pixel += Eigen::Vector2d(corner.point % 2 == 0 ? 2 : -2, 0);
  }
  const auto choice = select_lens_model(InitialSolutions(input));
  ASSERT_TRUE(choice);
  EXPECT_TRUE(choice->model == LensModel::opencv8 || choice->model == LensModel::opencv12)
      << describe_lens_choice(*choice);
  EXPECT_NEAR(find_rms(*choice, choice->model), kNoise_px, 0.4 * kNoise_px);
}

TEST(SelectLensModel, RejectsOpencv4ForRationalLensEvenIfFewViewsLieFarFromCenter) {
  constexpr std::size_t all = 30, far = 6;
  constexpr double inner_px = 220;
  SyntheticViews views{synthetic_board(false), rational_lens()};
  views.farthest = 4;
  Random random(43);
  IntrinsicsInput input = views.input(0, random, kNoise_px);
  const Eigen::Vector2d middle = rational_lens().principal_point_px();
  while (input.views.size() < all) {
    const BoardDetection seen = views.random_view(random, kNoise_px);
    if (!input.lattice.can_determine_pose(seen)) continue;
    auto corners = input.lattice.list_corners(seen);
    const bool inner = std::all_of(corners.begin(), corners.end(), [&](const auto& corner) {
      return (corner.pixel - middle).norm() < inner_px;
    });
    // Every fifth view shows the board farther from the center.
    if (inner == (input.views.size() % (all / far) != 0)) input.views.push_back(std::move(corners));
  }
  const auto choice = select_lens_model(InitialSolutions(input));
  ASSERT_TRUE(choice);
  EXPECT_NE(lens_model_name(choice->model), lens_model_name(LensModel::opencv4))
      << describe_lens_choice(*choice);
  EXPECT_LT(find_rms(*choice, choice->model), 2 * kNoise_px);
}

TEST(SelectLensModel, ReturnsNulloptForFewerThanSixViews) {
  EXPECT_FALSE(select_lens_model(InitialSolutions(seen_through(radial_lens(), 5))));
  EXPECT_TRUE(select_lens_model(InitialSolutions(seen_through(radial_lens(), 6))));
}

TEST(SelectLensModel, ReturnsFisheyeForCornersBeyond90DegreesOffAxis) {
  Random random(44);
  const auto choice = select_lens_model(InitialSolutions(wide_input(false, 24, random, kNoise_px)));
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->model, LensModel::fisheye);
  EXPECT_GT(choice->beyond_right_angle_rad, 1.58);
  EXPECT_LT(choice->beyond_right_angle_rad, 2);
  ASSERT_FALSE(choice->candidates.empty());
  for (const LensCandidate& tried : choice->candidates) {
    EXPECT_EQ(std::isfinite(tried.rms_px), tried.model == LensModel::fisheye);
  }
  EXPECT_EQ(select_lens_model(InitialSolutions(seen_through(fisheye_lens(), 8)))
                .value()
                .beyond_right_angle_rad,
            0);
}

TEST(SolveIntrinsics, GivesSameLensFromInitialSolutionsOfOtherModel) {
  IntrinsicsInput input = seen_through(rational_lens(), 12);
  const InitialSolutions initial(input);
  ASSERT_TRUE(solve_intrinsics(initial, LensModel::fisheye).has_succeeded());
  input.lens_model = LensModel::opencv8;
  const IntrinsicsSolution alone = solve_intrinsics(input);
  ASSERT_TRUE(alone.has_succeeded());
  EXPECT_EQ(solve_intrinsics(initial, LensModel::opencv8).problem.intrinsics,
            alone.problem.intrinsics);
}

TEST(IsFisheyeWorse, ReturnsTrueOnlyForLensThatFisheyeCannotFit) {
  constexpr double low_noise_px = 0.002;  // the models differ by less than kNoise_px
  const auto is_worse = [&](const Lens& lens, LensModel other) {
    const SyntheticViews views{synthetic_board(false), lens};
    Random random(41);
    return is_fisheye_worse(InitialSolutions(views.input(12, random, low_noise_px)), other);
  };
  EXPECT_TRUE(is_worse(rational_lens(), LensModel::opencv8));
  EXPECT_FALSE(is_worse(fisheye_lens(), LensModel::opencv4));
}

TEST(IsFisheyeWorse, ReturnsFalseIfCornersExceed90DegreesOffAxis) {
  Random random(44);
  const InitialSolutions initial(wide_input(false, 24, random, kNoise_px));
  EXPECT_FALSE(is_fisheye_worse(initial, LensModel::opencv8));
}

TEST(DescribeLensChoice, StatesOffAxisAngleWhenBoardIsBeyond90DegreesOffAxis) {
  const LensChoice choice{
      LensModel::fisheye, {{LensModel::opencv4}, {LensModel::fisheye, 0.0512, 0, 0}}, 1.7};
  EXPECT_EQ(describe_lens_choice(choice),
            "OPENCV_FISHEYE 0.0512 px (0.0 % above the best, limit 0.0 %) in held-out views; the "
            "board is visible up to 97 degrees off axis, where no LENSMODEL_OPENCVn has rays");
}

/// Returns views of a board of 4 x 3 tags without shifts of the edges, in fast solves.
IntrinsicsInput make_small_views(const Lens& lens, int count, double noise_px) {
  Board board = synthetic_board(false);
  board.cols = 4;
  board.rows = 3;
  const SyntheticViews views{board, lens};
  Random random(51);
  return make_views_without_edge_shifts(views, count, random, noise_px);
}

TEST(CompareLensModels, ReturnsNulloptForFewerThanFiveViews) {
  for (const int count : {4, 5}) {
    const IntrinsicsSolution reference =
        solve_intrinsics(make_small_views(radial_lens(), count, 0.02));
    ASSERT_TRUE(reference.has_succeeded());
    EXPECT_EQ(compare_lens_models(reference).has_value(), count == 5);
  }
}

}  // namespace
}  // namespace vlp
