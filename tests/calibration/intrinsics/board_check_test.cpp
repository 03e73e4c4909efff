// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_check.h"

#include <gmock/gmock.h>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class BoardCheckOf : public testing::TestWithParam<bool> {
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
    return check_board(board, seen_, lens).problem;
  }
};

TEST_P(BoardCheckOf, TheRightBoardHasNoProblem) {
  EXPECT_THAT(problem(views_.board), IsEmpty());
  EXPECT_THAT(problem(views_.board, views_.lens), IsEmpty());
  EXPECT_NEAR(*check_board(views_.board, seen_, views_.lens).pitch, 1 + views_.board.tag_spacing,
              0.005);
}

TEST_P(BoardCheckOf, AnotherTagSizeCannotBeSeen) {
  Board board = views_.board;
  board.tag_size_m *= 2;
  EXPECT_THAT(problem(board, views_.lens), IsEmpty());
}

TEST_P(BoardCheckOf, AnotherSpacingIsNamed) {
  Board board = views_.board;
  board.tag_spacing += 0.2;
  EXPECT_THAT(problem(board), HasSubstr("but the images show gaps of"));
  board.tag_spacing = views_.board.tag_spacing + 0.04;
  EXPECT_THAT(problem(board), IsEmpty());
  EXPECT_THAT(problem(board, views_.lens), HasSubstr(GetParam() ? "gaps of 0.3 " : "gaps of 1 "));
}

TEST_P(BoardCheckOf, AnotherOrderIsNamed) {
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

TEST_P(BoardCheckOf, AnotherBoardIsCalledSo) {
  Board board = views_.board;
  board.cols = 7;
  EXPECT_THAT(problem(board), HasSubstr("is it another board?"));
}

INSTANTIATE_TEST_SUITE_P(Boards, BoardCheckOf, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

}  // namespace
}  // namespace vlp
