// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board_layout.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

Board board_with(const IdOrder& order) {
  return {"tag36h11", 3, 2, 0.02, 0.5, 1, false, 10, order};
}

/// Returns the ids row by row from the top left.
std::vector<int> ids_of(const IdOrder& order) {
  std::vector<int> ids;
  for (const BoardTag& tag : list_board_tags(board_with(order))) ids.push_back(tag.id);
  return ids;
}

TEST(ListBoardTags, PlacesCharucoMarkersInWhiteSquares) {
  Board board{"DICT_4X4_50", 5, 4, 0.01, 1, 1, false, 3, {false, BoardCorner::top_left}};
  board.kind = BoardKind::charuco;
  board.square_size_m = 0.02;
  const auto markers = list_board_tags(board);
  ASSERT_EQ(markers.size(), 10U);
  // The first inner corner is the origin; the marker is in the square right of the first one.
  EXPECT_EQ(markers[0].id, 3);
  EXPECT_NEAR(markers[0].corners_m[3].x(), 0.005, 1e-12);
  EXPECT_NEAR(markers[0].corners_m[3].y(), -0.015, 1e-12);
  EXPECT_NEAR(markers[0].corners_m[1].y() - markers[0].corners_m[2].y(), 0.01, 1e-12);
  EXPECT_TRUE(is_square_black(board, 0, 0));
  EXPECT_EQ(compute_tag_field_size_m(board), Eigen::Vector2d(0.06, 0.04));
  EXPECT_EQ(list_inner_corners_m(board).back(), Eigen::Vector2d(0.06, 0.04));
  board.top_left_white = true;
  EXPECT_NEAR(list_board_tags(board)[0].corners_m[3].x(), -0.015, 1e-12);
}

TEST(ListBoardTags, NumbersTagsInEachIdOrderOfBoard) {
  using enum BoardCorner;
  EXPECT_EQ(ids_of({false, top_left}), (std::vector{10, 11, 12, 13, 14, 15}));
  EXPECT_EQ(ids_of({false, top_right}), (std::vector{12, 11, 10, 15, 14, 13}));
  EXPECT_EQ(ids_of({false, bottom_left}), (std::vector{13, 14, 15, 10, 11, 12}));
  EXPECT_EQ(ids_of({false, bottom_right}), (std::vector{15, 14, 13, 12, 11, 10}));
  EXPECT_EQ(ids_of({true, top_left}), (std::vector{10, 12, 14, 11, 13, 15}));
  EXPECT_EQ(ids_of({true, top_right}), (std::vector{14, 12, 10, 15, 13, 11}));
  EXPECT_EQ(ids_of({true, bottom_left}), (std::vector{11, 13, 15, 10, 12, 14}));
  EXPECT_EQ(ids_of({true, bottom_right}), (std::vector{15, 13, 11, 14, 12, 10}));
}

TEST(ListBoardTags, PlacesLastTagAtMultiplesOfTagPitch) {
  const Board board = board_with({false, BoardCorner::top_left});
  EXPECT_DOUBLE_EQ(compute_tag_pitch_m(board), 0.03);
  EXPECT_TRUE(compute_tag_field_size_m(board).isApprox(Eigen::Vector2d(0.08, 0.05)));
  const BoardTag last = list_board_tags(board).back();
  const auto [bottom_left, bottom_right, top_right, top_left] = last.corners_m;
  EXPECT_TRUE(bottom_left.isApprox(Eigen::Vector2d(0.06, 0.05)));
  EXPECT_TRUE(bottom_right.isApprox(Eigen::Vector2d(0.08, 0.05)));
  EXPECT_TRUE(top_right.isApprox(Eigen::Vector2d(0.08, 0.03)));
  EXPECT_TRUE(top_left.isApprox(Eigen::Vector2d(0.06, 0.03)));
}

}  // namespace
}  // namespace vlp
