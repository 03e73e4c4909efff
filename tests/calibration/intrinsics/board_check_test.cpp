// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <iterator>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class CheckBoardLayout : public testing::TestWithParam<bool> {
 protected:
  const SyntheticViews views_{synthetic_board(GetParam()), synthetic_lens()};
  std::vector<BoardView> seen_;

  void SetUp() override {
    Random random(21);
    for (int i = 0; i < 8; ++i) {
      seen_.push_back({"", views_.imager_px, views_.random_view(random, 0.05)});
    }
  }
  std::string problem(const Board& board, const std::optional<Lens>& lens = {}) const {
    return check_board_layout(board, seen_, lens).problem;
  }
};

TEST_P(CheckBoardLayout, ReportsNoProblemForCorrectBoard) {
  EXPECT_THAT(problem(views_.board), IsEmpty());
  EXPECT_THAT(problem(views_.board, views_.lens), IsEmpty());
  EXPECT_NEAR(check_board_layout(views_.board, seen_, views_.lens).pitch.value(),
              1 + views_.board.tag_spacing, 0.005);
}

TEST_P(CheckBoardLayout, ReportsNoProblemForWrongTagSize) {
  Board board = views_.board;
  board.tag_size_m *= 2;
  EXPECT_THAT(problem(board, views_.lens), IsEmpty());
}

TEST_P(CheckBoardLayout, ReportsMeasuredGapWhenTagSpacingIsWrong) {
  Board board = views_.board;
  board.tag_spacing += 0.2;
  EXPECT_THAT(problem(board), HasSubstr("but the images show gaps of"));
  board.tag_spacing = views_.board.tag_spacing + 0.04;
  EXPECT_THAT(problem(board), IsEmpty());
  EXPECT_THAT(problem(board, views_.lens), HasSubstr(GetParam() ? "gaps of 0.3 " : "gaps of 1 "));
}

TEST_P(CheckBoardLayout, ReportsDetectedIdOrderWhenGivenOrderIsWrong) {
  for (const bool column_major : {false, true}) {
    for (const auto from : {BoardCorner::bottom_right, BoardCorner::top_left}) {
      Board board = views_.board;
      board.id_order = {column_major, from};
      EXPECT_THAT(problem(board), HasSubstr("id_order row-major-from-bottom-left"));
    }
  }
  Board board = views_.board;
  std::swap(board.cols, board.rows);
  EXPECT_THAT(problem(board), HasSubstr("cols 6, rows 5"));
}

TEST_P(CheckBoardLayout, ReportsDetectedIdOrderOfSquareBoardForWrongOrder) {
  Board truth = views_.board;
  truth.rows = truth.cols;
  const SyntheticViews views{truth, views_.lens};
  Random random(22);
  std::vector<BoardView> seen;
  for (int i = 0; i < 8; ++i) {
    seen.push_back({"", views.imager_px, views.random_view(random, 0.05)});
  }
  EXPECT_THAT(check_board_layout(truth, seen, {}).problem, IsEmpty());
  for (const bool column_major : {false, true}) {
    for (const auto from : {BoardCorner::bottom_right, BoardCorner::top_left}) {
      Board board = truth;
      board.id_order = {column_major, from};
      EXPECT_THAT(check_board_layout(board, seen, {}).problem,
                  HasSubstr("cols 6, rows 6, id_order row-major-from-bottom-left"));
    }
  }
}

TEST_P(CheckBoardLayout, ReportsDetectedColumnsWhenGivenNumberIsWrong) {
  for (const int cols : {4, 5, 7}) {
    Board board = views_.board;
    board.cols = cols;
    EXPECT_THAT(problem(board), HasSubstr("the images show cols 6, rows 5, id_order "
                                          "row-major-from-bottom-left"))
        << cols;
  }
}

/// As in the detector: tags with ids that the board does not have are foreign.
TEST_P(CheckBoardLayout, ReportsDetectedRowsAndFirstIdFromForeignTags) {
  Board board = views_.board;
  board.rows = 4;
  for (BoardView& view : seen_) {
    auto& tags = view.detection.tags;
    std::copy_if(tags.begin(), tags.end(), std::back_inserter(view.detection.foreign_tags),
                 [](const TagDetection& tag) { return tag.id >= 24; });
    std::erase_if(tags, [](const TagDetection& tag) { return tag.id >= 24; });
  }
  EXPECT_THAT(problem(board), HasSubstr("the images show cols 6, rows 5"));
  board.first_id = 100;
  board.rows = 5;
  EXPECT_THAT(problem(board), HasSubstr("cols 6, rows 5, id_order row-major-from-bottom-left, "
                                        "first_id 0"));
}

TEST_P(CheckBoardLayout, ReportsNoProblemForSingleForeignTags) {
  for (const int id : {100, 31}) {
    auto views = seen_;
    for (BoardView& view : views) {
      TagDetection stray = view.detection.tags.front();
      stray.id = id;
      for (auto& corner : stray.corners_px) corner += Eigen::Vector2d(-150, 40);
      view.detection.foreign_tags.push_back(stray);
    }
    EXPECT_THAT(check_board_layout(views_.board, views, {}).problem, IsEmpty()) << id;
  }
}

TEST_P(CheckBoardLayout, ReportsNoProblemForTagsOfSecondBoard) {
  for (BoardView& view : seen_) {
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (const TagDetection& tag : view.detection.tags) {
      for (const auto& corner : tag.corners_px) {
        low = low.cwiseMin(corner);
        high = high.cwiseMax(corner);
      }
    }
    for (TagDetection tag : view.detection.tags) {
      tag.id += 30;
      for (auto& corner : tag.corners_px) corner.x() += 1.1 * (high - low).x();
      view.detection.foreign_tags.push_back(tag);
    }
  }
  EXPECT_THAT(problem(views_.board), IsEmpty());
}

/// A column determines the number of columns, but not the direction of the ids in a row.
TEST_P(CheckBoardLayout, ReportsNoLayoutIfOnlyTagsOfOneColumnAreSeen) {
  for (BoardView& view : seen_) {
    std::erase_if(view.detection.tags, [](const TagDetection& tag) { return tag.id % 6 != 2; });
  }
  Board board = views_.board;
  board.cols = 4;
  EXPECT_THAT(problem(board), HasSubstr("do not lie as on a board of 4 x 5 tags"));
}

TEST_P(CheckBoardLayout, SuggestsAnotherBoardWhenTagIdsArePermuted) {
  for (BoardView& view : seen_) {
    for (TagDetection& tag : view.detection.tags) tag.id = tag.id * 7 % 30;
  }
  EXPECT_THAT(problem(views_.board), HasSubstr("is it another board?"));
}

INSTANTIATE_TEST_SUITE_P(Boards, CheckBoardLayout, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

}  // namespace
}  // namespace vlp
