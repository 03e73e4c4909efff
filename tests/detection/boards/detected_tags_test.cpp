// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Selection of detected tags: image border, overexposure, order, and conversion of images.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/drawn_tags.h"
#include "detection/boards/tag_finder.h"
#include "support/matchers.h"

namespace vlp {
namespace {

Board make_board(int cols = 1, int rows = 1) {
  return {"tag36h11", cols, rows, 0.05, 0.4, 1, false, 0, {false, BoardCorner::bottom_right}};
}

TEST(BoardDetector, DetectsTagsWithTrueCornersSortedById) {
  const DrawnTags drawn(make_board(3, 2), 5);
  const BoardDetection seen = BoardDetector(drawn.board).detect_board(drawn.image);
  ASSERT_EQ(seen.tags.size(), 6U);
  for (std::size_t i = 0; i < seen.tags.size(); ++i) {
    EXPECT_EQ(seen.tags[i].id, static_cast<int>(i));
    const auto expected = std::ranges::find(drawn.truth, seen.tags[i].id, &TagDetection::id);
    ASSERT_NE(expected, drawn.truth.end());
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_THAT(seen.tags[i].corners_px[k], IsNear(expected->corners_px[k], 0.02));
    }
  }
}

// The tag is rotated by 45 degrees. Its outermost corners are at 26.2 and 116.8 px.
TEST(BoardDetector, RejectsTagsWithCornerNearImageBorder) {
  const DrawnTags drawn(make_board(), 8);
  cv::Mat1b rotated;
  cv::warpAffine(drawn.image, rotated, cv::getRotationMatrix2D({71.5F, 71.5F}, 45, 1), {160, 160},
                 cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(DrawnTags::kWhite));
  Board foreign = drawn.board;
  foreign.first_id = 100;
  const auto expect_num_tags = [&](const cv::Range& columns, const cv::Range& rows,
                                   std::size_t num_tags) {
    SCOPED_TRACE(testing::Message() << columns.start << " " << rows.start << " " << columns.end);
    const cv::Mat1b part = rotated(rows, columns).clone();
    const BoardDetection seen = BoardDetector(drawn.board).detect_board(part);
    EXPECT_EQ(seen.tags.size(), num_tags);
    EXPECT_EQ(seen.num_unusable_tags, num_tags == 1 ? 0 : 1);
    EXPECT_EQ(seen.num_overexposed_tags, 0);
    EXPECT_EQ(BoardDetector(foreign).detect_board(part).foreign_tags.size(), num_tags);
  };
  const cv::Range all(0, 160);
  for (const auto& [start, num_tags] : {std::pair(24, 1U), std::pair(25, 0U)}) {
    expect_num_tags({start, 160}, all, num_tags);
    expect_num_tags(all, {start, 160}, num_tags);
  }
  for (const auto& [end, num_tags] : {std::pair(120, 1U), std::pair(119, 0U)}) {
    expect_num_tags({0, end}, all, num_tags);
    expect_num_tags(all, {0, end}, num_tags);
  }
}

// A bit is 1.6 % of a tag.
TEST(BoardDetector, CountsRejectedTagsWithMoreThan10PercentWhitePixelsAsOverexposed) {
  constexpr int bit_px = 8;
  const DrawnTags drawn(make_board(), bit_px);
  const Eigen::Vector2i top_left = drawn.truth[0].corners_px[3].array().ceil().cast<int>();
  for (const auto& [num_white_bits, level, num_overexposed] :
       {std::tuple{5, 255, 0}, {8, 255, 1}, {8, 254, 1}, {8, 253, 0}}) {
    cv::Mat1b image = drawn.image.clone();
    int white_bits = 0;
    for (int i = 0; i < 64 && white_bits < num_white_bits; ++i) {
      const cv::Rect bit(top_left.x() + bit_px * (i % 8), top_left.y() + bit_px * (i / 8), bit_px,
                         bit_px);
      if (image(bit)(bit_px / 2, bit_px / 2) < 100) continue;
      image(bit) = static_cast<uchar>(level);
      ++white_bits;
    }
    ASSERT_EQ(white_bits, num_white_bits);
    cv::hconcat(image, image, image);
    const BoardDetection seen = BoardDetector(drawn.board).detect_board(image);
    EXPECT_TRUE(seen.tags.empty());
    EXPECT_EQ(seen.num_unusable_tags, 1);
    EXPECT_EQ(seen.num_overexposed_tags, num_overexposed) << num_white_bits << " " << level;
  }
}

TEST(BoardDetector, DetectsNoCornersInTinyImages) {
  Board board{"DICT_4X4_50", 3, 3, 0.015, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = BoardKind::charuco;
  board.square_size_m = 0.02;
  for (const auto& [width, height] : {std::pair(9, 50), std::pair(50, 9), std::pair(10, 10)}) {
    EXPECT_FALSE(
        BoardDetector(board).detect_board(cv::Mat1b(height, width, uchar{100})).has_corners());
  }
}

TEST(BoardDetector, DetectsTagsWithBordersOfTwoAndThreeBits) {
  for (const int border_bits : {2, 3}) {
    Board board = make_board(2, 1);
    board.border_bits = border_bits;
    const DrawnTags drawn(board, 4);
    const BoardDetection seen = BoardDetector(board).detect_board(drawn.image);
    ASSERT_EQ(seen.tags.size(), 2U) << border_bits;
    for (const TagDetection& tag : seen.tags) {
      const auto expected = std::ranges::find(drawn.truth, tag.id, &TagDetection::id);
      ASSERT_NE(expected, drawn.truth.end());
      EXPECT_THAT(tag.corners_px[0], IsNear(expected->corners_px[0], 0.02));
    }
  }
}

TEST(MakeApriltagFinder, CorrectsTwoWrongBits) {
  constexpr int bit_px = 6;
  for (const auto& [border_bits, id] : {std::pair(1, 0), {2, 0}, {2, 1}, {2, 2}, {2, 3}}) {
    Board board = make_board();
    board.border_bits = border_bits;
    board.first_id = id;
    const DrawnTags drawn(board, bit_px);
    const Eigen::Vector2i top_left = drawn.truth[0].corners_px[3].array().ceil().cast<int>();
    const auto finder = make_apriltag_finder(board);
    cv::Mat1b image = drawn.image.clone();
    for (const std::size_t num_wrong : {1U, 2U, 3U}) {
      // Bits in the inner rows, one in each.
      const int column = border_bits + 2, row = border_bits + static_cast<int>(num_wrong);
      cv::Mat1b bit = image(
          cv::Rect(top_left.x() + bit_px * column, top_left.y() + bit_px * row, bit_px, bit_px));
      bit = bit(bit_px / 2, bit_px / 2) > 120 ? DrawnTags::kBlack : DrawnTags::kWhite;
      EXPECT_EQ(finder->detect_tags(image).size(), num_wrong <= 2 ? 1U : 0U)
          << border_bits << " " << num_wrong;
    }
  }
}

}  // namespace
}  // namespace vlp
