// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tone_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

/// An image that calls for gamma so clearly, with a corner that moves with its logarithm by a
/// parabola.
SeenBoard image(double gamma, double clearly) {
  const auto corners = [](double x) {
    SeenTag::Corners all;
    for (auto& corner : all) corner = {100 - 0.5 * x + 0.1 * x * x, 50 + 0.3 * x};
    return all;
  };
  SeenBoard seen;
  SeenTag tag{7, corners(0)};
  for (const double each : kGammas) {
    const double x = std::log(each);
    seen.curve_costs.push_back(300 + clearly * std::pow(x - std::log(gamma), 2));
    if (each != 1) tag.behind_curves_px.push_back(corners(x));
  }
  seen.tags.push_back(tag);
  return seen;
}

double common_gamma(std::vector<SeenBoard>& images) {
  std::vector<SeenBoard*> all;
  for (SeenBoard& each : images) all.push_back(&each);
  return take_common_curve(all);
}

TEST(CommonCurve, IsWhatAnImageCallsForAndMovesItsCorners) {
  for (const double gamma : {1.0, 1.2, 1.7, 2.2, 2.4}) {
    std::vector<SeenBoard> images{image(gamma, 500)};
    EXPECT_NEAR(common_gamma(images), gamma, 1e-9);
    const double x = std::log(gamma);
    EXPECT_NEAR(images[0].tags[0].corners_px[3].x(), 100 - 0.5 * x + 0.1 * x * x, 1e-9);
    EXPECT_NEAR(images[0].tags[0].corners_px[3].y(), 50 + 0.3 * x, 1e-9);
  }
}

TEST(CommonCurve, IsOneForAllImages) {
  std::vector<SeenBoard> images{image(1.6, 300), image(2.0, 300), image(1.1, 10)};
  const double gamma = common_gamma(images);
  EXPECT_NEAR(gamma, 1.76, 0.03);
  for (const SeenBoard& each : images) {
    EXPECT_NEAR(each.tags[0].corners_px[0].y(), 50 + 0.3 * std::log(gamma), 1e-9);
  }
}

TEST(CommonCurve, IsNotMadeByAnImageThatShowsSomethingElse) {
  std::vector<SeenBoard> images(12, image(1, 500));
  images.push_back(image(2.4, 1e7));
  EXPECT_EQ(common_gamma(images), 1);
  EXPECT_EQ(images.back().tags[0].corners_px[0].x(), 100);
}

TEST(CommonCurve, IsNoneOfImagesThatHaveNoneForSure) {
  SeenBoard plain = image(1, 500);
  plain.curve_costs.resize(2);
  plain.tags[0].behind_curves_px.clear();
  std::vector<SeenBoard> images{plain, plain, image(1.3, 20), SeenBoard()};
  EXPECT_LT(common_gamma(images), 1.1);
  EXPECT_EQ(images[0].tags[0].corners_px[0].x(), 100);
}

TEST(CommonCurve, IsNoneWithoutImages) {
  std::vector<SeenBoard> none, without(2);
  EXPECT_EQ(common_gamma(none), 1);
  EXPECT_EQ(common_gamma(without), 1);
}

}  // namespace
}  // namespace vlp
