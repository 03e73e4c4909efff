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
#include <vector>

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
      << describe_lens_model_choice(*choice);
  // Noise, and errors outside the region of the other views.
  EXPECT_NEAR(find_rms(*choice, choice->model), kNoise_px, 0.25 * kNoise_px);
  EXPECT_EQ(choice->candidates.size(), 5U);
  EXPECT_TRUE(describe_lens_model_choice(*choice).starts_with(lens_model_name(lens.lens_model())))
      << describe_lens_model_choice(*choice);
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
      << describe_lens_model_choice(*choice);
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
    if (!input.lattice.are_corners_sufficient_for_pose(seen)) continue;
    auto corners = input.lattice.list_corners_with_board_positions(seen);
    const bool inner = std::all_of(corners.begin(), corners.end(), [&](const auto& corner) {
      return (corner.pixel - middle).norm() < inner_px;
    });
    // Every fifth view shows the board farther from the center.
    if (inner == (input.views.size() % (all / far) != 0)) input.views.push_back(std::move(corners));
  }
  const auto choice = select_lens_model(InitialSolutions(input));
  ASSERT_TRUE(choice);
  EXPECT_NE(lens_model_name(choice->model), lens_model_name(LensModel::opencv4))
      << describe_lens_model_choice(*choice);
  EXPECT_LT(find_rms(*choice, choice->model), 2 * kNoise_px);
}

TEST(SelectLensModel, ReturnsNulloptForFewerThanSixViews) {
  EXPECT_FALSE(select_lens_model(InitialSolutions(seen_through(radial_lens(), 5))));
  EXPECT_TRUE(select_lens_model(InitialSolutions(seen_through(radial_lens(), 6))));
}

TEST(SelectLensModel, ReturnsFisheyeForCornersBeyondRightAngle) {
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

TEST(IsFisheyeModelClearlyWorse, ReturnsTrueOnlyForLensThatFisheyeCannotFit) {
  constexpr double low_noise_px = 0.002;  // the models differ by less than kNoise_px
  const auto is_worse = [&](const Lens& lens, LensModel other) {
    const SyntheticViews views{synthetic_board(false), lens};
    Random random(41);
    return is_fisheye_model_clearly_worse(InitialSolutions(views.input(12, random, low_noise_px)),
                                          other);
  };
  EXPECT_TRUE(is_worse(rational_lens(), LensModel::opencv8));
  EXPECT_FALSE(is_worse(fisheye_lens(), LensModel::opencv4));
}

TEST(IsFisheyeModelClearlyWorse, ReturnsFalseBeyondRightAngle) {
  Random random(44);
  const InitialSolutions initial(wide_input(false, 24, random, kNoise_px));
  EXPECT_FALSE(is_fisheye_model_clearly_worse(initial, LensModel::opencv8));
}

TEST(DescribeLensModelChoice, StatesOffAxisAngleWhenBoardIsBeyondRightAngle) {
  const LensChoice choice{
      LensModel::fisheye, {{LensModel::opencv4}, {LensModel::fisheye, 0.0512, 0, 0}}, 1.7};
  EXPECT_EQ(describe_lens_model_choice(choice),
            "OPENCV_FISHEYE 0.0512 px (0.0 % above the best, limit 0.0 %) in held-out views; the "
            "board is visible up to 97 degrees off axis, where no LENSMODEL_OPENCVn has rays");
}

TEST(DescribeLensModelChoice, ListsFiguresOfOtherModelsAndThoseWithoutLens) {
  const LensChoice choice{LensModel::fisheye,
                          {{LensModel::opencv4, 0.25, 4.0403, 0.2},
                           {LensModel::fisheye, 0.0512, 0.0323, 0.048},
                           {LensModel::opencv5, 0.0496, 0, 0.0323},
                           {LensModel::opencv8}}};
  EXPECT_EQ(describe_lens_model_choice(choice),
            "OPENCV_FISHEYE 0.0512 px (3.2 % above the best, limit 4.8 %) in held-out views; "
            "LENSMODEL_OPENCV4 0.2500 px (404.0 % above the best, limit 20.0 %); "
            "LENSMODEL_OPENCV5 0.0496 px (0.0 % above the best, limit 3.2 %); "
            "LENSMODEL_OPENCV8 no lens");
}

/// Corners in a row of a board of 4 x 3 tags.
constexpr std::size_t kSmallCols = 8;

/// Returns views of a board of 4 x 3 tags without shifts of the edges, in fast solves.
IntrinsicsInput make_small_views(const Lens& lens, int count, double noise_px) {
  Board board = synthetic_board(false);
  board.cols = 4;
  board.rows = 3;
  const SyntheticViews views{board, lens};
  Random random(51);
  return make_views_without_edge_shifts(views, count, random, noise_px);
}

TEST(FitFisheyeLens, ReturnsLargestAngleOfCornerOffAxis) {
  const IntrinsicsInput input = make_small_views(fisheye_lens(), 6, 0);
  double max_rad = 0;
  for (const auto& view : input.views) {
    for (const auto& corner : view) {
      const auto ray = fisheye_lens().unproject_pixel(corner.pixel);
      ASSERT_TRUE(ray);
      max_rad = std::max(max_rad, std::atan2(ray->direction.head<2>().norm(), ray->direction.z()));
    }
  }
  const auto fit = fit_fisheye_lens(InitialSolutions(input));
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->solution.problem.lens_model, LensModel::fisheye);
  EXPECT_GT(max_rad, 1);
  EXPECT_NEAR(fit->max_corner_angle_rad, max_rad, 1e-4);
}

TEST(FitFisheyeLens, ReturnsNulloptAboveTwoPixelsRms) {
  for (const auto& [size_px, fits] : {std::pair{1.9, true}, {2.25, false}}) {
    IntrinsicsInput input = make_small_views(fisheye_lens(), 8, 0);
    for (auto& view : input.views) displace_alternately(view, size_px, kSmallCols);
    EXPECT_EQ(fit_fisheye_lens(InitialSolutions(input)).has_value(), fits);
  }
}

TEST(FitFisheyeLens, ReturnsNulloptForTwoViews) {
  EXPECT_FALSE(fit_fisheye_lens(InitialSolutions(make_small_views(fisheye_lens(), 2, 0))));
}

/// A corner at the angle of 0.7 rad is 2 f tan(0.35) from the middle of the image.
TEST(MayBeWideAngleLens, ReturnsTrueForCornerBeyond0Point7Rad) {
  for (const double focal_px : {800 / std::sqrt(2.0), 400.0}) {
    const Lens lens(LensModel::stereographic, std::array{focal_px, focal_px, 399.5, 299.5});
    IntrinsicsInput input = make_small_views(lens, 5, 0.01);
    const double limit_px = 2 * focal_px * std::tan(0.35);
    for (auto& view : input.views) {
      std::erase_if(view, [&](const auto& corner) {
        return (corner.pixel - lens.principal_point_px()).norm() > 0.9 * limit_px;
      });
      ASSERT_GE(view.size(), 8U);
    }
    auto& corner = input.views[1].back();
    corner.pixel = lens.principal_point_px() + 0.98 * limit_px * Eigen::Vector2d(0.8, -0.6);
    const InitialSolutions inside(input);
    ASSERT_NEAR(inside.initial_focal_lengths_px().front(), focal_px, 1e-9);
    EXPECT_FALSE(may_be_wide_angle_lens(inside));
    corner.pixel = lens.principal_point_px() + 1.02 * limit_px * Eigen::Vector2d(0.8, -0.6);
    EXPECT_TRUE(may_be_wide_angle_lens(InitialSolutions(input)));
  }
}

TEST(MayBeWideAngleLens, ReturnsFalseWithoutViews) {
  EXPECT_FALSE(may_be_wide_angle_lens(InitialSolutions(make_small_views(fisheye_lens(), 0, 0))));
}

/// Compares the decision with the ratio of both fits after the first stages.
TEST(IsFisheyeModelClearlyWorse, ComparesRatioOfMeanSquaresWith1Point5) {
  int slightly_larger = 0, slightly_smaller = 0;
  for (const double noise_px : {0.02, 0.03, 0.04, 0.06, 0.08}) {
    const InitialSolutions initial(make_small_views(rational_lens(), 8, noise_px));
    const auto fisheye = initial.solve_first_stages(LensModel::fisheye),
               other = initial.solve_first_stages(LensModel::opencv8);
    ASSERT_TRUE(fisheye && other);
    ASSERT_EQ(fisheye->views, other->views);
    const double ratio = std::pow(fisheye->rms_px / other->rms_px, 2);
    if (ratio > 1.5 && ratio < 2) ++slightly_larger;
    if (ratio > 1.1 && ratio < 1.5) ++slightly_smaller;
    EXPECT_EQ(is_fisheye_model_clearly_worse(initial, LensModel::opencv8), ratio > 1.5) << ratio;
  }
  EXPECT_GT(slightly_larger, 0);
  EXPECT_GT(slightly_smaller, 0);
}

TEST(IsFisheyeModelClearlyWorse, ReturnsFalseForTwoViews) {
  const InitialSolutions initial(make_small_views(rational_lens(), 2, 0.001));
  EXPECT_FALSE(is_fisheye_model_clearly_worse(initial, LensModel::opencv8));
}

TEST(IsFisheyeModelClearlyWorse, ReturnsFalseIfOtherModelDoesNotFit) {
  Random random(5);
  WideBoards boards;
  boards.reach_rad = 1.4;
  const InitialSolutions initial(wide_input(false, 7, random, kNoise_px, {0, 0}, boards));
  ASSERT_TRUE(initial.solve_first_stages(LensModel::fisheye));
  ASSERT_FALSE(initial.solve_first_stages(LensModel::opencv5));
  EXPECT_FALSE(is_fisheye_model_clearly_worse(initial, LensModel::opencv5));
}

/// Returns the largest mean of log ratios of squares that is within a limit: `errors` standard
/// errors from the means of blocks.
double compute_expected_limit(const std::vector<double>& log_ratios, std::size_t blocks,
                              double errors) {
  const std::size_t views = log_ratios.size();
  const auto count = static_cast<double>(blocks);
  double mean = 0;
  std::vector<double> sums(blocks);
  for (const double log : log_ratios) mean += log / static_cast<double>(views);
  for (std::size_t view = 0; view < views; ++view)
    sums[view * blocks / views] += log_ratios[view] - mean;
  double squares = 0;
  for (const double sum : sums) squares += sum * sum;
  return errors * std::sqrt(count / (count - 1) * squares) / static_cast<double>(views);
}

/// Recomputes the printed figures and the rule from the fits, with views that only some models fit.
TEST(CompareLensModels, RejectsModelsAboveLimitAndSelectsSmallestOther) {
  constexpr std::array models{LensModel::opencv4, LensModel::fisheye, LensModel::opencv5,
                              LensModel::opencv8, LensModel::opencv12};
  int rejected = 0, kept = 0;
  struct Case {
    int count;
    double errors, student;
  };
  // One standard error, and the factor of two, widened by Student's t with one degree of freedom
  // less than views.
  for (const auto& [count, errors, student] :
       {Case{7, 1.08961, 1.26033}, Case{11, 1.05219, 1.14232}}) {
    for (const double noise_px : {0.02, 0.1}) {
      const IntrinsicsSolution reference =
          solve_intrinsics(make_small_views(rational_lens(), count, noise_px));
      ASSERT_TRUE(reference.has_succeeded());
      const auto choice = compare_lens_models(reference);
      ASSERT_TRUE(choice);
      ASSERT_EQ(choice->candidates.size(), models.size());
      std::vector<std::vector<double>> logs;
      std::vector<double> means;
      for (std::size_t i = 0; i < models.size(); ++i) {
        const LensCandidate& candidate = choice->candidates[i];
        ASSERT_EQ(candidate.model, models[i]);
        ASSERT_TRUE(candidate.fit);
        logs.push_back(compute_left_out_mean_squares_px2(*candidate.fit, 5));
        means.push_back(0);
        for (double& value : logs.back()) {
          value = std::log(value);
          means.back() += value / count;
        }
        EXPECT_NEAR(candidate.rms_px, std::exp(means.back() / 2), 1e-9);
      }
      const auto best = static_cast<std::size_t>(std::ranges::min_element(means) - means.begin());
      std::vector<bool> is_within_limit;
      for (std::size_t i = 0; i < models.size(); ++i) {
        std::vector<double> ratios = logs[i];
        for (std::size_t view = 0; view < ratios.size(); ++view) ratios[view] -= logs[best][view];
        const double excess = means[i] - means[best];
        is_within_limit.push_back(excess <= compute_expected_limit(ratios, ratios.size(), errors));
        const bool may_describe =
            excess <= std::max(compute_expected_limit(ratios, ratios.size(), 2 * student),
                               compute_expected_limit(ratios, 5, 2.884346));
        EXPECT_EQ(choice->candidates[i].excess <= choice->candidates[i].max_plausible_excess,
                  may_describe);
      }
      const auto first = std::ranges::find(is_within_limit, true) - is_within_limit.begin();
      const double max_mean = means[static_cast<std::size_t>(first)];
      std::size_t selected = models.size();
      for (std::size_t i = models.size(); i-- > 0;) {
        const bool is_rejected = !is_within_limit[i] && means[i] > max_mean;
        EXPECT_EQ(choice->candidates[i].is_rejected(), is_rejected) << i;
        ++(is_rejected ? rejected : kept);
        if (!is_rejected) selected = i;
      }
      ASSERT_LT(selected, models.size());
      EXPECT_EQ(choice->model, models[selected]);
      for (std::size_t i = 0; i < models.size(); ++i)
        EXPECT_TRUE(!choice->candidates[i].is_rejected() || means[i] > means[selected]) << i;
    }
  }
  EXPECT_GT(rejected, 2);
  EXPECT_GT(kept, 4);
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
