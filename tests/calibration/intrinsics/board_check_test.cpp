// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_check.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

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

TEST_P(CheckBoardLayout, ReportsTrueIdOrderWhenGivenOneIsWrong) {
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

TEST_P(CheckBoardLayout, ReportsTrueIdOrderOfSquareBoardWhenGivenOneIsWrong) {
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

TEST_P(CheckBoardLayout, SuggestsAnotherBoardWhenTagIdsArePermuted) {
  for (BoardView& view : seen_) {
    for (TagDetection& tag : view.detection.tags) tag.id = tag.id * 7 % 30;
  }
  EXPECT_THAT(problem(views_.board), HasSubstr("is it another board?"));
}

INSTANTIATE_TEST_SUITE_P(Boards, CheckBoardLayout, testing::Bool(),
                         [](const auto& board) { return board.param ? "Kalibr" : "Plain"; });

/// Frontal view of a board by a camera without perspective.
struct FlatView {
  double px_per_m = 1000, rotation_rad = 0, shift_px = 0;
};

bool is_any_tag(int) { return true; }

/// Returns the view of the tags of a board with these ids; `shift_px` moves their edges inwards.
BoardView make_flat_view(const Board& board, const FlatView& view,
                         const std::function<bool(int id)>& is_shown = is_any_tag) {
  BoardView seen{"", {2000, 2000}, {}};
  for (const BoardTag& place : list_board_tags(board)) {
    if (!is_shown(place.id)) continue;
    TagDetection tag{place.id, {}};
    for (std::size_t k = 0; k < 4; ++k) {
      tag.corners_px[k] =
          Eigen::Vector2d(900, 700) +
          view.px_per_m * (Eigen::Rotation2Dd(view.rotation_rad) * place.corners_m[k]);
    }
    seen.detection.tags.push_back(shrunk(tag, view.shift_px));
  }
  return seen;
}

std::vector<BoardView> make_flat_views(const Board& board, const std::vector<FlatView>& views,
                                       const std::function<bool(int id)>& is_shown = is_any_tag) {
  std::vector<BoardView> seen;
  seen.reserve(views.size());
  for (const FlatView& view : views) seen.push_back(make_flat_view(board, view, is_shown));
  return seen;
}

/// Board of 4 x 3 tags of 20 mm with gaps of 8 mm.
Board small_board() {
  Board board = synthetic_board(false);
  board.cols = 4;
  board.rows = 3;
  board.tag_spacing = 0.4;
  board.id_order = {false, BoardCorner::top_left};
  return board;
}

std::string layout_problem(const Board& stated, const std::vector<BoardView>& views) {
  return check_board_layout(stated, views, {}).problem;
}

TEST(CheckFlatBoardLayout, ReportsTrueIdOrderForEachWrongOne) {
  for (const bool column_major : {false, true}) {
    for (const auto from : {BoardCorner::bottom_left, BoardCorner::bottom_right,
                            BoardCorner::top_left, BoardCorner::top_right}) {
      Board truth = small_board();
      truth.id_order = {column_major, from};
      const auto views = make_flat_views(truth, {{1000, 0.3, 0}, {1500, -2, 0}});
      EXPECT_EQ(layout_problem(truth, views), "");
      EXPECT_NEAR(check_board_layout(truth, views, {}).pitch.value(), 1.4, 1e-9);
      Board stated = truth;
      stated.id_order.column_major = !column_major;
      const std::string expected =
          "the images show cols 4, rows 3, id_order " + id_order_name(truth.id_order);
      EXPECT_EQ(layout_problem(stated, views), expected);
      stated = truth;
      stated.id_order.from =
          from == BoardCorner::top_left ? BoardCorner::top_right : BoardCorner::top_left;
      EXPECT_EQ(layout_problem(stated, views), expected);
    }
  }
}

TEST(CheckFlatBoardLayout, SpacingToleranceIsFivePercentOrOnePercentWithLens) {
  const std::array parameters{800.0, 800.0, 1000.0, 1000.0};
  const Lens lens(LensModel::pinhole, parameters);
  const auto views = make_flat_views(small_board(), {{1000, 0.3, 0}, {1000, -2, 0}});
  struct Stated {
    double tag_spacing;
    bool fits, fits_with_lens;
  };
  // The pitch is 1.4 tags: 1.4 / 1.05 = 1.333, 1.4 / 0.95 = 1.474, 1.4 / 1.01 = 1.386 and 1.4 /
  // 0.99 = 1.414.
  for (const auto& [tag_spacing, fits, fits_with_lens] :
       {Stated{0.33, false, false}, Stated{0.335, true, false}, Stated{0.385, true, false},
        Stated{0.388, true, true}, Stated{0.413, true, true}, Stated{0.416, true, false},
        Stated{0.472, true, false}, Stated{0.476, false, false}}) {
    Board stated = small_board();
    stated.tag_spacing = tag_spacing;
    EXPECT_EQ(layout_problem(stated, views).empty(), fits) << tag_spacing;
    const BoardCheck with_lens = check_board_layout(stated, views, lens);
    EXPECT_EQ(with_lens.problem.empty(), fits_with_lens) << tag_spacing;
    EXPECT_NEAR(with_lens.pitch.value(), 1.4, 1e-9);
  }
  Board stated = small_board();
  stated.tag_spacing = 0.25;
  EXPECT_EQ(layout_problem(stated, views),
            "tag_spacing is 0.25, but the images show gaps of 0.4 tags");
}

TEST(CheckFlatBoardLayout, PitchIsCorrectedForGivenEdgeDisplacement) {
  // Tags of 20 px with edges moved inwards by 1 px are 18 px wide; the pitch is 28 px.
  const auto views = make_flat_views(small_board(), {{1000, 0.3, 1}, {1000, -2, 1}});
  EXPECT_NEAR(check_board_layout(small_board(), views, {}, 0).pitch.value(), 28 / 18.0, 1e-9);
  EXPECT_NEAR(check_board_layout(small_board(), views, {}, 1).pitch.value(), 1.4, 1e-9);
  EXPECT_NEAR(check_board_layout(small_board(), views, {}, 9).pitch.value(), 28 / 21.0, 1e-9);
  EXPECT_NEAR(check_board_layout(small_board(), views, {}, -9).pitch.value(), 28 / 15.0, 1e-9);
}

/// Tags of several widths separate the spacing from the displacement of the edges.
TEST(CheckFlatBoardLayout, ReportsNoProblemForEdgesDisplacedByUpTo1Point5Pixels) {
  const auto views_with_shift = [](double shift_px, const std::vector<double>& scales) {
    std::vector<FlatView> views;
    for (const double scale : scales) views.push_back({scale, 0.1 * scale, shift_px});
    return make_flat_views(small_board(), views);
  };
  const std::vector<double> several{700, 1000, 1500, 2000};
  for (const double shift_px : {1.45, 1.0, -1.0, -1.45}) {
    const auto views = views_with_shift(shift_px, several);
    EXPECT_GT(std::abs(check_board_layout(small_board(), views, {}).pitch.value() / 1.4 - 1), 0.05);
    EXPECT_EQ(layout_problem(small_board(), views), "") << shift_px;
    Board stated = small_board();
    stated.tag_spacing = 0.6;  // 1.6 / 1.4 = 1.14
    // Edges moved inwards increase the pitch, as a larger spacing does.
    if (shift_px < 0) EXPECT_NE(layout_problem(stated, views), "") << shift_px;
  }
  for (const double shift_px : {1.6, -1.6}) {
    EXPECT_NE(layout_problem(small_board(), views_with_shift(shift_px, several)), "") << shift_px;
  }
  EXPECT_NE(layout_problem(small_board(), views_with_shift(1.4, {1000, 1000, 1000, 1000})), "")
      << "tags of one width";
}

TEST(CheckFlatBoardLayout, IgnoresTagsWithoutRaysOrBehindCamera) {
  const std::array fisheye{100.0, 100.0, 400.0, 300.0, 0.0, 0.0, 0.0, 0.0};
  const Lens lens(LensModel::fisheye, fisheye);
  // All tags are more than 90 degrees (157 px) from the axis.
  const auto far = make_flat_views(small_board(), {{1000, 0, 0}, {1000, 0, 0}});
  EXPECT_TRUE(check_board_layout(small_board(), far, {}).pitch);
  EXPECT_FALSE(check_board_layout(small_board(), far, lens).pitch);
}

/// ChArUco board of 7 x 5 squares of 30 mm with markers of 22.5 mm.
Board charuco_board() {
  Board board = small_board();
  board.kind = BoardKind::charuco;
  board.family = "DICT_5X5_100";
  board.cols = 7;
  board.rows = 5;
  board.tag_size_m = 0.0225;
  board.square_size_m = 0.03;
  return board;
}

TEST(CheckCharucoLayout, ReportsNoProblemForCorrectBoard) {
  for (const bool top_left_white : {false, true}) {
    Board board = charuco_board();
    board.top_left_white = top_left_white;
    const auto views = make_flat_views(board, {{1000, 0.3, 0}, {1500, -2, 0}});
    const BoardCheck check = check_board_layout(board, views, {});
    EXPECT_EQ(check.problem, "");
    ASSERT_TRUE(check.pitch);
    EXPECT_NEAR(*check.pitch, 4.0 / 3, 1e-9);
  }
}

TEST(CheckCharucoLayout, ReportsSquareToMarkerRatioOffBy15Percent) {
  const auto views = make_flat_views(charuco_board(), {{1000, 0.3, 0}, {1500, -2, 0}});
  struct Stated {
    double marker_m;
    bool fits;
  };
  // Squares are 1.333 markers wide: 1.333 / 1.15 = 1.159 (marker of 25.9 mm) and 1.333 / 0.85 =
  // 1.569 (19.1 mm).
  for (const auto& [marker_m, fits] :
       {Stated{0.0261, false}, Stated{0.0257, true}, Stated{0.0193, true}, Stated{0.0189, false}}) {
    Board stated = charuco_board();
    stated.tag_size_m = marker_m;
    EXPECT_EQ(layout_problem(stated, views).empty(), fits) << marker_m;
  }
  Board stated = charuco_board();
  stated.tag_size_m = 0.018;
  EXPECT_EQ(layout_problem(stated, views),
            "a square is 1.67 markers wide by board.yaml, but 1.33 in the images");
}

TEST(CheckCharucoLayout, ReportsNumberOfSquaresDerivedFromMarkers) {
  const auto views = make_flat_views(charuco_board(), {{1000, 0.3, 0}, {1500, -2, 0}});
  Board stated = charuco_board();
  stated.cols = 8;
  EXPECT_EQ(layout_problem(stated, views), "the images show cols 7, rows 5, top_left black");
  stated.cols = 5;
  stated.rows = 7;
  EXPECT_EQ(layout_problem(stated, views), "the images show cols 7, rows 5, top_left black");
  Board white = charuco_board();
  white.top_left_white = true;
  white.rows = 6;
  const auto white_views = make_flat_views(white, {{1000, 0.3, 0}, {1500, -2, 0}});
  EXPECT_EQ(layout_problem(white, white_views), "");
  stated = white;
  stated.cols = 6;
  stated.top_left_white = false;
  EXPECT_EQ(layout_problem(stated, white_views), "the images show cols 7, rows 6, top_left white");
}

/// With an odd number of columns, more than four fifths of the steps agree with either color.
TEST(CheckCharucoLayout, NamesColorOfFirstSquareForOddNumberOfColumns) {
  for (const auto& [cols, rows] : {std::pair(7, 5), {7, 9}, {11, 8}, {5, 7}}) {
    for (const bool is_white : {false, true}) {
      Board board = charuco_board();
      board.cols = cols;
      board.rows = rows;
      board.top_left_white = is_white;
      const auto views = make_flat_views(board, {{1000, 0.3, 0}, {1500, -2, 0}});
      EXPECT_EQ(layout_problem(board, views), "") << cols << " x " << rows;
      board.top_left_white = !is_white;
      EXPECT_EQ(layout_problem(board, views), "the images show cols " + std::to_string(cols) +
                                                  ", rows " + std::to_string(rows) + ", top_left " +
                                                  (is_white ? "white" : "black"));
    }
  }
}

TEST(CheckCharucoLayout, KeepsGivenNumberOfRowsIfFewerAreDetected) {
  const auto views = make_flat_views(charuco_board(), {{1000, 0.3, 0}, {1500, -2, 0}});
  Board stated = charuco_board();
  stated.rows = 9;
  EXPECT_EQ(layout_problem(stated, views), "");
  stated.top_left_white = !stated.top_left_white;
  EXPECT_EQ(layout_problem(stated, views), "the images show cols 7, rows 9, top_left black");
  // Boards of six columns, with the other color of the first square.
  Board six = charuco_board();
  six.cols = 6;
  const auto views_of_six = make_flat_views(six, {{1000, 0.3, 0}, {1500, -2, 0}});
  six.rows = 9;
  EXPECT_EQ(layout_problem(six, views_of_six), "");
  six.top_left_white = true;
  EXPECT_EQ(layout_problem(six, views_of_six), "the images show cols 6, rows 9, top_left black");
}

}  // namespace
}  // namespace vlp
