// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tone_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

/// Creates an image with costs that have their minimum at `gamma` and the curvature `clearly`. Its
/// corners are a parabola of log(gamma).
BoardView image(double gamma, double clearly) {
  const auto corners = [](double x) {
    SeenTag::Corners all;
    for (auto& corner : all) corner = {100 - 0.5 * x + 0.1 * x * x, 50 + 0.3 * x};
    return all;
  };
  const auto bows = [](double x) {
    SeenTag::Bows all;
    all.fill({0.2 + 0.05 * x, -0.01 * x, 0.8});
    return all;
  };
  BoardView view{"image", {200, 100}, {}};
  const auto sds = [](double x) {
    SeenTag::Deviations all;
    all.fill(0.02 + 0.01 * x);
    return all;
  };
  SeenTag tag{7, corners(0), bows(0), sds(0)};
  for (const double each : kGammas) {
    const double x = std::log(each);
    view.seen.curve_costs.push_back(300 + clearly * std::pow(x - std::log(gamma), 2));
    if (each != 1) tag.behind_curves.push_back({corners(x), bows(x), sds(x)});
  }
  view.seen.tags.push_back(tag);
  return view;
}

double take_levels_curve(std::vector<BoardView>& views) {
  return take_curve(views, costs_of_levels(views));
}

TEST(ApplyToneCurve, EstimatesGammaAndInterpolatesCorners) {
  for (const double gamma : {1.25, 1.7, 2.2, 2.4}) {
    std::vector<BoardView> images{image(gamma, 500)};
    EXPECT_NEAR(take_levels_curve(images), gamma, 1e-9);
    const double x = std::log(gamma);
    EXPECT_NEAR(images[0].seen.tags[0].corners_px[3].x(), 100 - 0.5 * x + 0.1 * x * x, 1e-9);
    EXPECT_NEAR(images[0].seen.tags[0].corners_px[3].y(), 50 + 0.3 * x, 1e-9);
    const EdgeBow& bow = images[0].seen.tags[0].bows[2];
    EXPECT_NEAR(bow.square_px, 0.2 + 0.05 * x, 1e-9);
    EXPECT_NEAR(bow.cube_px, -0.01 * x, 1e-9);
    EXPECT_EQ(bow.reach, 0.8);
    EXPECT_NEAR(images[0].seen.tags[0].sds_px[1], 0.02 + 0.01 * x, 1e-9);
  }
}

TEST(ApplyToneCurve, InterpolatesStandardDeviationsLinearly) {
  std::vector<BoardView> images{image(1.8, 500)};
  SeenTag& tag = images[0].seen.tags[0];
  const double at = std::log(1.8 / 1.6) / std::log(2.0 / 1.6);
  for (std::size_t i = 0; i < 4; ++i)
    tag.behind_curves[i].sds_px[0] = std::array{0.024, 0.024, 0.026, 0.19}[i];
  tag.behind_curves[2].sds_px[1] = 0;  // unknown for one of the tone curves
  take_levels_curve(images);
  EXPECT_NEAR(images[0].seen.tags[0].sds_px[0], 0.024 + at * 0.002, 1e-9);
  EXPECT_EQ(images[0].seen.tags[0].sds_px[1], 0);
}

TEST(ApplyToneCurve, EstimatesCommonGammaOfAllImages) {
  std::vector<BoardView> images{image(1.6, 300), image(2.0, 300), image(1.1, 10)};
  const double gamma = take_levels_curve(images);
  EXPECT_NEAR(gamma, 1.76, 0.03);
  for (const BoardView& each : images) {
    EXPECT_NEAR(each.seen.tags[0].corners_px[0].y(), 50 + 0.3 * std::log(gamma), 1e-9);
  }
}

TEST(ApplyToneCurve, LimitsInfluenceOfSingleImage) {
  std::vector<BoardView> images(12, image(1, 500));
  images.push_back(image(2.4, 1e7));
  EXPECT_EQ(take_levels_curve(images), 1);
  EXPECT_EQ(images.back().seen.tags[0].corners_px[0].x(), 100);
}

TEST(ApplyToneCurve, ReturnsOneForSmallGamma) {
  std::vector<BoardView> images{image(1.15, 500)};
  EXPECT_EQ(take_levels_curve(images), 1);
  EXPECT_EQ(images[0].seen.tags[0].corners_px[0].x(), 100);
}

TEST(ApplyToneCurve, KeepsCornersOfImagesWithoutToneCurve) {
  BoardView plain = image(1, 500);
  plain.seen.curve_costs.resize(2);
  plain.seen.tags[0].behind_curves.clear();
  std::vector<BoardView> images{plain, image(2, 500), image(2, 500), {"none", {200, 100}, {}}};
  EXPECT_GT(take_levels_curve(images), 1.5);
  EXPECT_EQ(images[0].seen.tags[0].corners_px[0].x(), 100);
  EXPECT_LT(images[1].seen.tags[0].corners_px[0].x(), 99.8);
}

TEST(ApplyToneCurve, DoesNothingWhenRepeated) {
  std::vector<BoardView> images{image(2, 500)};
  take_levels_curve(images);
  const auto once = images[0].seen.tags[0].corners_px;
  EXPECT_EQ(take_levels_curve(images), 1);
  EXPECT_EQ(images[0].seen.tags[0].corners_px, once);
}

TEST(ApplyToneCurve, ReturnsOneWithoutImages) {
  std::vector<BoardView> none, without(2);
  EXPECT_EQ(take_levels_curve(none), 1);
  EXPECT_EQ(take_levels_curve(without), 1);
}

}  // namespace
}  // namespace vlp
