// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tone_curve.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace vlp {
namespace {

/// Creates an image with costs that have their minimum at `gamma` and the curvature `clearly`. Its
/// corners are a parabola of log(gamma).
BoardView image(double gamma, double clearly) {
  const auto corners = [](double x) {
    TagDetection::Corners all;
    for (auto& corner : all) corner = {100 - 0.5 * x + 0.1 * x * x, 50 + 0.3 * x};
    return all;
  };
  const auto curvatures = [](double x) {
    TagDetection::Curvatures all;
    all.fill({0.2 + 0.05 * x, -0.01 * x, 0.8});
    return all;
  };
  BoardView view{"image", {200, 100}, {}};
  const auto sds = [](double x) {
    TagDetection::CornerSds all;
    all.fill(0.02 + 0.01 * x);
    return all;
  };
  TagDetection tag{7, corners(0), curvatures(0), sds(0)};
  for (const double each : kGammas) {
    const double x = std::log(each);
    view.detection.curve_costs.push_back(300 + clearly * std::pow(x - std::log(gamma), 2));
    if (each != 1) tag.tone_curve_fits.push_back({corners(x), curvatures(x), sds(x)});
  }
  view.detection.tags.push_back(tag);
  return view;
}

double apply_curve_of_levels(std::vector<BoardView>& views) {
  return correct_views_for_tone_curve(views, sum_tone_curve_costs(views));
}

TEST(CorrectViewsForToneCurve, InterpolatesCornersAndCurvaturesAtEstimatedGamma) {
  for (const double gamma : {1.25, 1.7, 2.2, 2.4}) {
    std::vector<BoardView> images{image(gamma, 500)};
    EXPECT_NEAR(apply_curve_of_levels(images), gamma, 1e-9);
    const double x = std::log(gamma);
    EXPECT_NEAR(images[0].detection.tags[0].corners_px[3].x(), 100 - 0.5 * x + 0.1 * x * x, 1e-9);
    EXPECT_NEAR(images[0].detection.tags[0].corners_px[3].y(), 50 + 0.3 * x, 1e-9);
    const EdgeCurvature& bow = images[0].detection.tags[0].curvatures[2];
    EXPECT_NEAR(bow.quadratic_px, 0.2 + 0.05 * x, 1e-9);
    EXPECT_NEAR(bow.cubic_px, -0.01 * x, 1e-9);
    EXPECT_EQ(bow.reach, 0.8);
    EXPECT_NEAR(images[0].detection.tags[0].corner_sds_px[1], 0.02 + 0.01 * x, 1e-9);
  }
}

TEST(CorrectViewsForToneCurve, CorrectsAllViewsForOneCommonGamma) {
  std::vector<BoardView> images{image(1.6, 300), image(2.0, 300), image(1.1, 10)};
  const double gamma = apply_curve_of_levels(images);
  EXPECT_NEAR(gamma, 1.76, 0.03);
  for (const BoardView& each : images) {
    EXPECT_NEAR(each.detection.tags[0].corners_px[0].y(), 50 + 0.3 * std::log(gamma), 1e-9);
  }
}

TEST(CorrectViewsForToneCurve, KeepsCornersWhenOnlyOneOfManyViewsShowsCurve) {
  std::vector<BoardView> images(12, image(1, 500));
  images.push_back(image(2.4, 1e7));
  EXPECT_EQ(apply_curve_of_levels(images), 1);
  EXPECT_EQ(images.back().detection.tags[0].corners_px[0].x(), 100);
}

TEST(CorrectViewsForToneCurve, ChangesNoCornersOfViewsWithoutToneCurveFits) {
  BoardView plain = image(1, 500);
  plain.detection.curve_costs.resize(2);
  plain.detection.tags[0].tone_curve_fits.clear();
  std::vector<BoardView> images{plain, image(2, 500), image(2, 500), {"none", {200, 100}, {}}};
  EXPECT_GT(apply_curve_of_levels(images), 1.5);
  EXPECT_EQ(images[0].detection.tags[0].corners_px[0].x(), 100);
  EXPECT_LT(images[1].detection.tags[0].corners_px[0].x(), 99.8);
}

TEST(CorrectViewsForToneCurve, KeepsCornersWhenRepeated) {
  std::vector<BoardView> images{image(2, 500)};
  apply_curve_of_levels(images);
  const auto once = images[0].detection.tags[0].corners_px;
  EXPECT_EQ(apply_curve_of_levels(images), 1);
  EXPECT_EQ(images[0].detection.tags[0].corners_px, once);
}

TEST(CorrectViewsForToneCurve, EstimatesGammaOfOneWithoutViewsOrTags) {
  std::vector<BoardView> none, without(2);
  EXPECT_EQ(apply_curve_of_levels(none), 1);
  EXPECT_EQ(apply_curve_of_levels(without), 1);
}

TEST(CorrectViewsForToneCurve, CorrectsCornersFromGammaOf1p2) {
  for (const auto& [gamma, is_corrected] : {std::pair(1.19, false), std::pair(1.21, true)}) {
    std::vector<BoardView> images{image(gamma, 500)};
    EXPECT_NEAR(apply_curve_of_levels(images), is_corrected ? gamma : 1, 1e-9);
    const TagDetection& tag = images[0].detection.tags[0];
    EXPECT_EQ(tag.corners_px[0].x() < 99.95, is_corrected);
    EXPECT_TRUE(tag.tone_curve_fits.empty());
    EXPECT_TRUE(images[0].detection.curve_costs.empty());
  }
}

TEST(CorrectViewsForToneCurve, InterpolatesSdsAndStepsBetweenAdjacentGammas) {
  for (const double gamma : {1.25, 1.45, 1.8, 2.2}) {
    SCOPED_TRACE(gamma);
    std::vector<BoardView> images{image(gamma, 500)};
    TagDetection& tag = images[0].detection.tags[0];
    const auto value = [](std::size_t i) { return std::array{0.5, 0.6, 0.9, 1.1, 1.9}[i]; };
    tag.steps.fill({value(0), 10 * value(0), 100 * value(0)});
    tag.corner_sds_px.fill(value(0));
    for (std::size_t i = 1; i < kGammas.size(); ++i) {
      tag.tone_curve_fits[i - 1].steps.fill({value(i), 10 * value(i), 100 * value(i)});
      tag.tone_curve_fits[i - 1].corner_sds_px.fill(value(i));
    }
    apply_curve_of_levels(images);
    std::size_t below = 0;
    while (below + 2 < kGammas.size() && kGammas[below + 1] < gamma) ++below;
    const double fraction =
        std::log(gamma / kGammas[below]) / std::log(kGammas[below + 1] / kGammas[below]);
    const double expected = (1 - fraction) * value(below) + fraction * value(below + 1);
    const TagDetection& corrected = images[0].detection.tags[0];
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(corrected.corner_sds_px[k], expected, 1e-9);
      EXPECT_NEAR(corrected.steps[k].blur_px, expected, 1e-9);
      EXPECT_NEAR(corrected.steps[k].dark, 10 * expected, 1e-8);
      EXPECT_NEAR(corrected.steps[k].bright, 100 * expected, 1e-7);
    }
  }
}

}  // namespace
}  // namespace vlp
