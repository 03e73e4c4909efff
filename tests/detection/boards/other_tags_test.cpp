// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/other_tags.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <string>

#include "detection/boards/drawn_tags.h"
#include "frontend/image_file.h"

namespace vlp {
namespace {

Board make_board_of_family(const std::string& family, int cols = 3, int rows = 2) {
  return {family, cols, rows, 0.05, 0.4, 1, false, 0, {false, BoardCorner::top_left}};
}

TEST(DescribeOtherTags, ReturnsEmptyForStatedBoard) {
  const DrawnTags drawn(make_board_of_family("tag36h11"), 5);
  EXPECT_EQ(describe_other_tags(drawn.board, drawn.image), "");
}

TEST(DescribeOtherTags, ReportsMirroredImage) {
  const DrawnTags drawn(make_board_of_family("tag36h11", 2, 2), 5);
  cv::Mat1b mirrored;
  cv::flip(drawn.image, mirrored, 1);
  EXPECT_EQ(describe_other_tags(drawn.board, mirrored),
            "the image is mirrored: mirror it back, or turn mirroring off in the camera");
}

TEST(DescribeOtherTags, NamesOtherFamilyOfFourTagsOrMore) {
  const DrawnTags four(make_board_of_family("tag25h9", 2, 2), 5);
  EXPECT_EQ(describe_other_tags(make_board_of_family("tag36h11"), four.image),
            "the image shows tags of family tag25h9, border_bits 1, corner_squares false");
  const DrawnTags three(make_board_of_family("tag25h9", 3, 1), 5);
  EXPECT_EQ(describe_other_tags(make_board_of_family("tag36h11"), three.image), "");
}

TEST(DescribeOtherTags, StatesBorderBitsAndCornerSquares) {
  const cv::Mat kalibr =
      read_image(VLP_SOURCE_DIR "/datasets/paper-rig-faulty/rendered/sample-boards/0000.png");
  EXPECT_EQ(describe_other_tags(make_board_of_family("tag36h11"), kalibr),
            "the image shows tags of family tag36h11, border_bits 2, corner_squares true");
  Board wide = make_board_of_family("tag36h11");
  wide.border_bits = 2;
  EXPECT_EQ(describe_other_tags(make_board_of_family("tag36h11"), DrawnTags(wide, 4).image),
            "the image shows tags of family tag36h11, border_bits 2, corner_squares false");
  EXPECT_EQ(describe_other_tags(wide, DrawnTags(make_board_of_family("tag36h11"), 4).image),
            "the image shows tags of family tag36h11, border_bits 1, corner_squares false");
}

// The image has more tags of another family than tags of the board.
TEST(DescribeOtherTags, NamesOtherFamilyOnlyWithMoreTagsThanBoard) {
  const DrawnTags own(make_board_of_family("tag36h11", 5, 1), 5);
  for (const auto& [cols, is_named] : {std::pair(5, false), std::pair(6, true)}) {
    const DrawnTags other(make_board_of_family("tag25h9", cols, 1), 5);
    cv::Mat1b both(own.image.rows + other.image.rows, std::max(own.image.cols, other.image.cols),
                   DrawnTags::kWhite);
    own.image.copyTo(both(cv::Rect({0, 0}, own.image.size())));
    other.image.copyTo(both(cv::Rect({0, own.image.rows}, other.image.size())));
    EXPECT_EQ(describe_other_tags(own.board, both).empty(), !is_named) << cols;
  }
}

TEST(DescribeOtherTags, ReturnsEmptyForChessboards) {
  Board board = make_board_of_family("");
  board.kind = BoardKind::chessboard;
  board.square_size_m = 0.02;
  EXPECT_EQ(describe_other_tags(board, DrawnTags(make_board_of_family("tag36h11"), 4).image), "");
}

}  // namespace
}  // namespace vlp
