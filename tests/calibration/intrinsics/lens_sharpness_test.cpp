// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_sharpness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace vlp {
namespace {

constexpr std::array kSharpnessImager_px{800, 600};
constexpr double kLensBlur_px = 0.8;

/// Step of the light at a place of a view.
using StepAt = std::function<EdgeStep(const Eigen::Vector2d& at_px, int view)>;

EdgeStep even_step(const Eigen::Vector2d&, int) { return {kLensBlur_px, 14, 190}; }

/// Returns views full of tags of 25 px, displaced from view to view, with noise of 2 % of the blur.
std::vector<BoardView> make_views(const StepAt& step_at, int count = 24) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.02);
  std::vector<BoardView> views;
  views.reserve(static_cast<std::size_t>(count));
  for (int view = 0; view < count; ++view) {
    BoardView& added = views.emplace_back(BoardView{"view", kSharpnessImager_px, {}});
    for (int i = 0; i < 16 * 12; ++i) {
      const double size_px = 25, x = 50 * (i % 16) + view % 5 * 5, y = 50 * (i / 16) + view % 7 * 3;
      TagDetection tag{i,
                       {{{x, y + size_px}, {x + size_px, y + size_px}, {x + size_px, y}, {x, y}}}};
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d at_px = (tag.corners_px[k] + tag.corners_px[(k + 1) % 4]) / 2;
        tag.steps[k] = step_at(at_px, view);
        tag.steps[k].blur_px *= 1 + noise(random);
      }
      added.detection.tags.push_back(std::move(tag));
    }
  }
  return views;
}

LensSharpness measured(const StepAt& step_at) {
  return measure_lens_sharpness(make_views(step_at), kSharpnessImager_px).value();
}

TEST(MeasureLensSharpness, ReturnsMtf50AndNoDefectsForUniformBlur) {
  const LensSharpness even = measured(even_step);
  EXPECT_NEAR(even.mean_mtf50, compute_mtf50_of_gaussian_blur(kLensBlur_px),
              0.02 * even.mean_mtf50);
  EXPECT_GT(even.worst_ratio, 0.97);
  EXPECT_LT(even.asymmetry, 0.02);
  EXPECT_LT(even.local_loss, 0.03);
  EXPECT_LT(even.local_shadow, 0.01);
  EXPECT_NEAR(even.black_level, 14.0 / 190, 1e-6);
}

TEST(MeasureLensSharpness, KeepsMeanMtf50WhenHalfOfViewsAreShaken) {
  const LensSharpness still = measured(even_step);
  const LensSharpness shaken = measured([](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    if (view % 2 == 0) step.blur_px = 2;
    return step;
  });
  EXPECT_NEAR(shaken.mean_mtf50, still.mean_mtf50, 0.02 * still.mean_mtf50);
}

TEST(MeasureLensSharpness, ReportsAsymmetryForTiltedFocalPlane) {
  const LensSharpness tilted = measured([](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    step.blur_px = std::hypot(step.blur_px, 1.0 * (at_px.x() / 400 - 1));
    return step;
  });
  EXPECT_GT(tilted.asymmetry, 0.15);
  EXPECT_LT(tilted.worst_ratio, 0.9);
}

TEST(MeasureLensSharpness, ReportsNoAsymmetryForRadiallySymmetricBlur) {
  const LensSharpness symmetric = measured([](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    step.blur_px *= 1 + 0.5 * (at_px - Eigen::Vector2d(400, 300)).squaredNorm() / 250000;
    return step;
  });
  EXPECT_LT(symmetric.asymmetry, 0.03);
  EXPECT_LT(symmetric.worst_ratio, 0.85);
  EXPECT_LT(symmetric.local_loss, 0.05);
}

TEST(MeasureLensSharpness, ReturnsDepthAndPositionOfDustShadow) {
  const Eigen::Vector2d dust_px(500, 200);
  const LensSharpness dusty = measured([&](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    const double light = (at_px - dust_px).norm() < 45 ? 0.8 : 1;
    step.dark *= light;
    step.bright *= light;
    return step;
  });
  EXPECT_GT(dusty.local_shadow, 0.15);
  EXPECT_LT((dusty.local_shadow_px - dust_px).norm(), 45);
  EXPECT_LT(dusty.local_loss, 0.05);
}

TEST(MeasureLensSharpness, ReportsLocalMtf50LossWhereLensIsSmeared) {
  const Eigen::Vector2d smear_px(300, 350);
  const LensSharpness smeared = measured([&](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    if ((at_px - smear_px).norm() < 60) step.blur_px *= 1.5;
    return step;
  });
  EXPECT_NEAR(smeared.local_loss, 1 - 1 / 1.5, 0.05);
  EXPECT_LT(smeared.worst_ratio, 0.75);
  EXPECT_LT(smeared.local_shadow, 0.01);
}

/// A part of the image with few views is not sharper than the others.
TEST(MeasureLensSharpness, Mtf50IsUnbiasedInImagePartsWithFewerViews) {
  std::mt19937 random(3);
  std::normal_distribution<double> of_view(0, 0.1);
  std::vector<double> ratios;
  for (int set = 0; set < 20; ++set) {
    std::array<double, 24> factors{};
    for (double& factor : factors) factor = 1 + of_view(random);
    const LensSharpness uneven =
        measure_lens_sharpness(make_views([&](const Eigen::Vector2d& at_px, int view) {
                                 EdgeStep step = even_step(at_px, view);
                                 step.blur_px *= factors[static_cast<std::size_t>(view)];
                                 if (at_px.x() < 200 && view >= 6)
                                   step.blur_px = 0;  // not measured
                                 return step;
                               }),
                               kSharpnessImager_px)
            .value();
    ratios.push_back(uneven.mtf50.at(1, 4) / uneven.mtf50.at(8, 4));
  }
  double mean = 0;
  for (const double ratio : ratios) mean += ratio / 20;
  EXPECT_NEAR(mean, 1, 0.03);
}

TEST(MeasureLensSharpness, ReturnsNanShadowForFewerThanEightTagsPerView) {
  // Seven tags in a view are 28 edges, too few for a field of the light; all views cover the image.
  const auto dense = make_views(even_step, 140);
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < dense.size(); ++i) {
    BoardView& view = views.emplace_back(dense[i]);
    std::erase_if(view.detection.tags, [&](const TagDetection& tag) {
      return static_cast<std::size_t>(tag.id) % 28 != i % 28;
    });
    ASSERT_LT(view.detection.tags.size(), 8U);
  }
  const auto found = measure_lens_sharpness(views, kSharpnessImager_px);
  ASSERT_TRUE(found);
  EXPECT_TRUE(std::isfinite(found->local_loss));
  EXPECT_TRUE(std::isnan(found->local_shadow));
}

TEST(MeasureLensSharpness, ReturnsNulloptWhenTagsHaveNoEdgeSteps) {
  auto views = make_views(even_step, 6);
  for (BoardView& view : views) {
    for (TagDetection& tag : view.detection.tags) tag.steps = {};
  }
  EXPECT_FALSE(measure_lens_sharpness(views, kSharpnessImager_px));
}

TEST(ComputeMedianEdgeMtf50, MatchesMtf50OfUniformEdgeBlur) {
  const auto views = make_views(even_step, 1);
  const auto found = compute_median_edge_mtf50(views[0].detection);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, compute_mtf50_of_gaussian_blur(kLensBlur_px), 0.01 * *found);
}

TEST(ComputeMedianEdgeMtf50, ReturnsMtf50OfUpperMedianBlur) {
  BoardDetection seen = make_views(even_step, 1)[0].detection;
  seen.tags.resize(2);
  const std::array blurs_px{2.0, 0.5, 0.7, 1.1, 9.0, 0.9, 0.4, 3.0};
  for (std::size_t i = 0; i < blurs_px.size(); ++i) {
    seen.tags[i / 4].steps[i % 4].blur_px = blurs_px[i];
  }
  const auto found = compute_median_edge_mtf50(seen);
  ASSERT_TRUE(found);
  EXPECT_DOUBLE_EQ(*found, compute_mtf50_of_gaussian_blur(1.1));

  seen.tags[0].steps[0].blur_px = 0;  // not measured
  const auto of_seven = compute_median_edge_mtf50(seen);
  ASSERT_TRUE(of_seven);
  EXPECT_DOUBLE_EQ(*of_seven, compute_mtf50_of_gaussian_blur(0.9));
}

}  // namespace
}  // namespace vlp
