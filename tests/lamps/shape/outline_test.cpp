// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "lamps/shape/drawn_disc.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

TEST(FindBlobOutline, PointsLieOnCircleOfDisc) {
  for (const int depth : {CV_8U, CV_16U}) {
    for (const double blur_px : {0.6, 0.8}) {
      const DrawnDisc disc{.blur_px = blur_px};
      const auto points = outline_in(disc.image(depth));
      EXPECT_GT(points.size(), 140U);
      EXPECT_LT(worst_off(disc, points, kSteep), 0.05) << blur_px;
    }
  }
}

TEST(FindBlobOutline, ReturnsLevelRiseAndSideOfEdges) {
  const DrawnDisc disc;
  const double rise_px = 2 * 0.6745 * disc.blur_px;  // between the quartiles of a normal curve
  const auto points = outline_in(disc.image(CV_16U));
  ASSERT_GT(points.size(), 140U);
  int steep = 0;
  for (const EdgePoint& point : points) {
    EXPECT_EQ(point.is_run_begin, point.pixel.x() < disc.center.x());
    EXPECT_EQ(point.pixel.y(), std::round(point.pixel.y()));
    if (disc.cosine(point.pixel) < 0.9) continue;
    ++steep;
    EXPECT_NEAR(point.level, disc.level * 65535, 0.01 * 65535);
    EXPECT_NEAR(point.rise_px, rise_px / disc.cosine(point.pixel), 0.25);
  }
  EXPECT_GT(steep, 0);
}

TEST(FindBlobOutline, ReturnsNoPointsAtImageBorderForCutDisc) {
  for (const double column : {25.0, 175.0}) {
    const DrawnDisc disc{.center = {column, 79.6}};
    const auto points = outline_in(disc.image(CV_16U));
    const bool left = column < 100;
    ASSERT_GT(points.size(), 60U);
    EXPECT_LT(worst_off(disc, points, kSteep), 0.05);
    for (const EdgePoint& point : points) {
      EXPECT_GT(point.pixel.x(), 2);
      EXPECT_LT(point.pixel.x(), 197);
    }
    EXPECT_TRUE(std::ranges::any_of(
        points, [&](const EdgePoint& point) { return point.is_run_begin != left; }));
  }
  EXPECT_TRUE(outline_in(cv::Mat(160, 200, CV_8U, cv::Scalar(9))).empty());
}

}  // namespace
}  // namespace vlp
