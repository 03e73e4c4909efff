// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/lit_tiles.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <utility>

#include "frontend/mat_view.h"

namespace vlp {
namespace {

constexpr double kThreshold = 100;

/// Dark, with lit boxes.
cv::Mat with_light(const std::vector<cv::Rect>& boxes, int depth = CV_8U) {
  cv::Mat image(200, 300, depth, cv::Scalar(10));
  for (const cv::Rect& box : boxes) image(box) = 200;
  return image;
}

bool is_lit(const TileMask& tiles, int x, int y) {
  return tiles.tile_row(y / kTile_px)[x / kTile_px] != 0;
}

int count(const TileMask& tiles) {
  int count = 0;
  for (const std::uint8_t value : tiles.values) count += value != 0;
  return count;
}

TEST(FindBrightTiles, DetectsLightsTwoPixelRowsHigh) {
  for (const int depth : {CV_8U, CV_16U}) {
    for (int y = 0; y + 2 <= 200; ++y) {
      for (const int x : {0, 63, 64, 130, 255, 256, 299}) {
        const cv::Mat image = with_light({{x, y, 1, 2}}, depth);
        const TileMask tiles = find_bright_tiles(to_image_view(image), kThreshold);
        ASSERT_EQ(tiles.columns, 5);
        ASSERT_EQ(tiles.rows, 4);
        EXPECT_TRUE(is_lit(tiles, x, y) && is_lit(tiles, x, y + 1)) << x << ", " << y;
        EXPECT_EQ(count(tiles), y % kTile_px == kTile_px - 1 ? 2 : 1) << x << ", " << y;
      }
    }
  }
}

TEST(FindBrightTiles, DetectsSingleRowStripesOverMoreThan16Rows) {
  for (const int period : {2, 3, 4, 5, 6, 8}) {
    for (int y = 0; y < 128; ++y) {
      std::vector<cv::Rect> stripes;
      for (int row = y; row <= y + 16 + period; row += period) stripes.emplace_back(100, row, 9, 1);
      const TileMask tiles = find_bright_tiles(to_image_view(with_light(stripes)), kThreshold);
      for (const cv::Rect& stripe : stripes) {
        EXPECT_TRUE(is_lit(tiles, 100, stripe.y)) << period << ", " << y << ", " << stripe.y;
      }
    }
  }
}

TEST(FindBrightTiles, IgnoresSinglePixels) {
  for (int y = 0; y < 200; ++y) {
    EXPECT_EQ(count(find_bright_tiles(to_image_view(with_light({{130, y, 1, 1}})), kThreshold)), 0)
        << y;
  }
}

TEST(FindBrightTiles, ReturnsNoTilesWhenThresholdIsWhiteOrHigher) {
  EXPECT_EQ(count(find_bright_tiles(to_image_view(with_light({{130, 80, 40, 40}})), 255)), 0);
  EXPECT_EQ(count(find_bright_tiles(to_image_view(with_light({{130, 80, 40, 40}})), 199.5)), 1);
  EXPECT_EQ(count(find_bright_tiles(to_image_view(with_light({{130, 80, 40, 40}})), 200)), 0);
}

TEST(FindTileGroupBoxes, JoinsTilesThatTouchAtCorners) {
  TileMask tiles(6, 5);
  for (const auto& [x, y] : {std::pair(1, 0), {2, 1}, {1, 2}, {5, 4}, {4, 4}})
    tiles.tile_row(y)[x] = 1;
  const auto boxes = find_tile_group_boxes(tiles);
  ASSERT_EQ(boxes.size(), 2U);
  EXPECT_EQ(boxes[0], (PixelBox{1, 0, 2, 3}));
  EXPECT_EQ(boxes[1], (PixelBox{4, 4, 2, 1}));
}

}  // namespace
}  // namespace vlp
