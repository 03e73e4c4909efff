// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

constexpr std::array kImager_px{800, 600};

IntrinsicsInput make_input(const Board& board, const std::vector<BoardView>& views,
                           LensModel model) {
  IntrinsicsInput input{BoardLattice(board), {}, kImager_px, model};
  for (const BoardView& view : views)
    input.views.push_back(input.lattice.list_corners(view.detection));
  return input;
}

class WriteMrcalCorners : public testing::TestWithParam<bool> {
 protected:
  const TemporaryFolder folder;
  const SyntheticViews views{synthetic_board(GetParam()), synthetic_lens()};
};

/// Tests a plain board, and a Kalibr board, which is four lattices for mrcal.
TEST_P(WriteMrcalCorners, RereadCornersYieldSameLensAsOriginalSolve) {
  constexpr int count = 12;
  Random random(3);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(count, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(std::to_string(i) + ".png");
  write_mrcal_corners(folder / "corners.vnl", solution, names);
  const auto read = read_mrcal_corners(folder / "corners.vnl", views.board, kImager_px);
  ASSERT_FALSE(read.empty());
  ASSERT_EQ(read.size(), solution.views.size());
  std::size_t corners = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].image, names[solution.views[i]]);
    corners += read[i].detection.points.size();
  }
  EXPECT_EQ(corners, static_cast<std::size_t>(solution.corners));
  const IntrinsicsSolution again =
      solve_intrinsics(make_input(views.board, read, LensModel::opencv8));
  ASSERT_TRUE(again.has_succeeded());
  EXPECT_LT(compare_projections(solution.fitted_lens(), again.fitted_lens(), kImager_px, even)
                .value()
                .worst_px,
            1e-3);
  EXPECT_NEAR(again.rms_px, solution.rms_px, 1e-5);
}

/// Images of two folders with the same names.
TEST_P(WriteMrcalCorners, MakesRepeatedImageNamesUniqueByNumbers) {
  constexpr std::size_t count = 8;
  Random random(3);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(count, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.views.size(), count);
  const std::vector<std::string> names{"0.png",   "1.png", "0.png", "1.png",
                                       "1.png-2", "a b",   "a_b",   "0.png"};
  write_mrcal_corners(folder / "corners.vnl", solution, names);
  std::vector<std::string> found;
  for (const BoardView& view :
       read_mrcal_corners(folder / "corners.vnl", views.board, kImager_px)) {
    EXPECT_TRUE(view.detection.has_corners());
    found.push_back(view.image);
  }
  EXPECT_EQ(found, (std::vector<std::string>{"0.png", "1.png", "0.png-2", "1.png-2", "1.png-2-2",
                                             "a_b", "a_b-2", "0.png-3"}));
}

INSTANTIATE_TEST_SUITE_P(Boards, WriteMrcalCorners, testing::Values(false, true));

Board chessboard() {
  Board board{"", 4, 5, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = BoardKind::chessboard;
  board.square_size_m = 0.02;
  return board;
}

std::string row(const std::string& x_and_y, const std::string& fourth) {
  return "0.png " + x_and_y + " " + fourth + "\n";
}

TEST(ReadMrcalCorners, ReturnsWeightsFromLevelOrWeightColumn) {
  const TemporaryFolder folder;
  std::string rows;
  for (int i = 0; i < 12; ++i) {
    rows += row(std::to_string(100 + 40 * (i % 3)) + " " + std::to_string(100 + 40 * (i / 3)),
                i == 0   ? "-"
                : i == 1 ? "0.5"
                         : "1");
  }
  rows += "none.png - -\n";
  const auto read = [&](const std::string& legend) {
    return read_mrcal_corners(folder.file("corners.vnl", "## a comment\n" + legend + rows),
                              chessboard(), kImager_px);
  };
  const auto by_level = read("# filename x y level\n");
  ASSERT_EQ(by_level.size(), 2U);
  EXPECT_FALSE(by_level[1].detection.has_corners());
  ASSERT_EQ(by_level[0].detection.points.size(), 11U);
  EXPECT_EQ(by_level[0].detection.points[0].index, 1U);
  EXPECT_EQ(by_level[0].detection.points[0].weight, 1);  // mrcal takes the whole part
  EXPECT_EQ(by_level[0].detection.points[1].weight, 0.5);
  const auto by_weight = read("# filename x y weight\n");
  ASSERT_EQ(by_weight.size(), 2U);
  ASSERT_EQ(by_weight[0].detection.points.size(), 11U);
  EXPECT_EQ(by_weight[0].detection.points[0].weight, 0.5);
  EXPECT_EQ(by_weight[0].detection.points[1].weight, 1);
}

/// Levels start at 0, so that weights above 1 are written as weights, also powers of two.
TEST(ReadMrcalCorners, ReturnsWeightsWrittenByWriteMrcalCorners) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(6);
  IntrinsicsInput input = views.input(6, random, 0.05);
  for (const double most : {1.0, 2.0}) {
    for (auto& view : input.views) {
      for (std::size_t i = 0; i < view.size(); ++i) view[i].weight = most / (i % 2 == 0 ? 1 : 4);
    }
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    ASSERT_GT(solution.corners, 0);
    const TemporaryFolder folder;
    const auto file = folder / "corners.vnl";
    const std::vector<std::string> names{"0", "1", "2", "3", "4", "5"};
    write_mrcal_corners(file, solution, names);
    std::size_t corners = 0;
    for (const BoardView& view : read_mrcal_corners(file, views.board, kImager_px)) {
      for (const PointDetection& point : view.detection.points) {
        EXPECT_TRUE(point.weight == most || point.weight == most / 4) << point.weight;
        ++corners;
      }
    }
    EXPECT_EQ(corners, static_cast<std::size_t>(solution.corners));
  }
}

/// Returns rows of an image with corners at distances of 40 px, `cols` in a row, for a board of
/// 4 x 5 squares.
std::string make_rows(const std::string& name, int count = 12, int cols = 3,
                      const std::string& fourth = "") {
  std::string rows;
  for (int i = 0; i < count; ++i) {
    rows += name + " " + std::to_string(100 + 40 * (i % cols)) + " " +
            std::to_string(200 + 40 * (i / cols)) + fourth + "\n";
  }
  return rows;
}

/// Reader of texts as corner tables.
class ReadMrcalCornerText : public testing::Test {
 protected:
  std::vector<BoardView> read(const std::string& text, const Board& board = chessboard()) const {
    return read_mrcal_corners(folder_.file("corners.vnl", text), board, kImager_px);
  }
  /// Returns the message without the folder.
  std::string rejection(const std::string& text, const Board& board = chessboard()) const {
    const std::string message = rejection_message([&] { read(text, board); });
    const std::size_t name = message.find("corners.vnl");
    return name == message.npos ? message : message.substr(name);
  }

  const TemporaryFolder folder_;
};

TEST_F(ReadMrcalCornerText, ReturnsPointsWithoutFourthColumn) {
  const auto views = read("\n" + make_rows("a.png") + "\r\n" + make_rows("b.png", 12, 3, " 0\r"));
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[0].image, "a.png");
  EXPECT_EQ(views[1].image, "b.png");
  for (const BoardView& view : views) {
    EXPECT_EQ(view.imager_px, kImager_px);
    ASSERT_EQ(view.detection.points.size(), 12U);
    for (std::size_t i = 0; i < 12; ++i) {
      const PointDetection& point = view.detection.points[i];
      EXPECT_EQ(point.index, i);
      EXPECT_EQ(point.pixel, Eigen::Vector2d(100 + 40. * static_cast<double>(i % 3),
                                             200 + 40. * static_cast<double>(i / 3)));
      EXPECT_EQ(point.weight, 1);
    }
  }
}

TEST_F(ReadMrcalCornerText, SkipsCornersThatWereNotSeen) {
  const std::string others = make_rows("a.png").substr(make_rows("a.png", 1).size());
  for (const char* const first :
       {"- 200", "100 -", "-1 200", "100 -1", "100 200 -", "100 200 -1"}) {
    const auto views = read("a.png " + std::string(first) + "\n" + others);
    ASSERT_EQ(views.size(), 1U);
    EXPECT_EQ(views[0].detection.points.size(), 11U) << first;
  }
  for (const char* const first : {"0 200", "100 0", "100 200 0"}) {
    const auto views = read("a.png " + std::string(first) + "\n" + others);
    ASSERT_EQ(views.size(), 1U);
    EXPECT_EQ(views[0].detection.points.size(), 12U) << first;
  }
}

TEST_F(ReadMrcalCornerText, WeightIsTwoToThePowerOfMinusLevel) {
  for (const auto& [level, weight] : std::vector<std::pair<std::string, double>>{
           {"0.9", 1}, {"1.9", 0.5}, {"2", 0.25}, {"30", std::pow(0.5, 30)}}) {
    const auto views = read(make_rows("a.png", 12, 3, " " + level));
    ASSERT_EQ(views.size(), 1U);
    ASSERT_EQ(views[0].detection.points.size(), 12U);
    EXPECT_EQ(views[0].detection.points[7].weight, weight);
  }
}

TEST_F(ReadMrcalCornerText, FirstLegendDeterminesFourthColumn) {
  const auto weight_with = [&](const std::string& legend) {
    const auto views = read(legend + make_rows("a.png", 12, 3, " 2"));
    return views.size() == 1 && views[0].detection.points.size() == 12
               ? views[0].detection.points[3].weight
               : 0;
  };
  EXPECT_EQ(weight_with("# filename x y weight\n"), 2);
  EXPECT_EQ(weight_with("# filename x y level\n# filename x y weight\n"), 0.25);
  EXPECT_EQ(weight_with("# filename x y weight\n# filename x y level\n"), 2);
  EXPECT_EQ(weight_with("## x weight\n#! x weight\n# filename x y level\n"), 0.25);
  EXPECT_EQ(weight_with("## x level\n#! x level\n# filename x y weight\n"), 2);
}

TEST_F(ReadMrcalCornerText, WeightsAreWithinZeroAnd1000) {
  const std::string legend = "# filename x y weight\n";
  const auto views = read(legend + make_rows("a.png", 12, 3, " 1000"));
  ASSERT_EQ(views.size(), 1U);
  ASSERT_EQ(views[0].detection.points.size(), 12U);
  EXPECT_EQ(views[0].detection.points[0].weight, 1000);
  for (const char* const unseen : {" 0", " -1", " -"}) {
    const auto none = read(legend + make_rows("a.png", 12, 3, unseen));
    ASSERT_EQ(none.size(), 1U);
    EXPECT_TRUE(none[0].detection.points.empty()) << unseen;
  }
}

TEST_F(ReadMrcalCornerText, MergesPartsOfImageInAnyOrder) {
  const Board board = synthetic_board(true);
  std::string text;
  for (const char* const part : {"3", "1", "0", "2"}) {
    text += make_rows(std::string("a.png-corner") + part, 30, 6);
    text += std::string("b.png-corner") + part + " - -\n";
  }
  const auto views = read(text, board);
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[0].image, "a.png");
  EXPECT_EQ(views[1].image, "b.png");
  EXPECT_TRUE(views[1].detection.points.empty());
  ASSERT_EQ(views[0].detection.points.size(), 120U);
  for (std::size_t i = 0; i < 120; ++i) {
    const PointDetection& point = views[0].detection.points[i];
    EXPECT_EQ(point.index, i);
    EXPECT_EQ(point.pixel, Eigen::Vector2d(100 + 40. * static_cast<double>(i % 30 % 6),
                                           200 + 40. * static_cast<double>(i % 30 / 6)));
  }
}

TEST_F(ReadMrcalCornerText, RenumbersCornersOfChessboardFromTopLeft) {
  // The corners of a mirrored numbering: rows count from the bottom.
  std::string rows;
  for (int i = 0; i < 12; ++i) {
    rows += "a.png " + std::to_string(100 + 40 * (i % 3)) + " " +
            std::to_string(400 - 40 * (i / 3)) + "\n";
  }
  const auto views = read(rows);
  ASSERT_EQ(views.size(), 1U);
  ASSERT_EQ(views[0].detection.points.size(), 12U);
  const auto& points = views[0].detection.points;
  const Eigen::Vector2d right = points[1].pixel - points[0].pixel;
  const Eigen::Vector2d down = points[3].pixel - points[0].pixel;
  EXPECT_GT(right.x() * down.y() - right.y() * down.x(), 0) << "not mirrored";
}

/// Errors name the line of the row that is wrong.
TEST_F(ReadMrcalCornerText, RejectsTablesOfOtherBoards) {
  struct Refusal {
    std::string text, line;
    Board board = chessboard();
  };
  Board seven_cols = chessboard();
  seven_cols.cols = 7;
  std::string outside, cut_short = make_rows("a.png");
  for (int i = 0; i < 12; ++i) outside += "a.png 900 " + std::to_string(200 + 40 * i) + "\n";
  cut_short.pop_back();
  const std::string weights = "# filename x y weight\n";
  std::vector<Refusal> refusals{
      {"\n", " contains no corner"},
      {weights, " contains no corner"},
      {"\na.png 1\n", "2: should be: filename x y level"},
      {"\na.png 1 2 3 4\n", "2: should be: filename x y level"},
      {cut_short, "12: the last line has no end"},
      {make_rows("a.png", 12, 3, " 30.5"), "1: a level"},
      {weights + make_rows("a.png", 12, 3, " 1000.5"), "2: a weight"},
      {"\n" + outside, "2: a corner at (900, 200)"},
      {"b.png - -\n" + make_rows("a.png", 11), "2: image 'a.png' has 11 rows"},
      {"b.png - -\n" + make_rows("a.png", 20), "2: image 'a.png' has 20 rows"},
      {make_rows("a.png", 30), "1: image 'a.png' has 30 rows", synthetic_board(false)},
      {make_rows("a.png-corner0", 29), "1: image 'a.png-corner0' has", synthetic_board(true)},
      {make_rows("a.png") + "b.png - -\n" + make_rows("a.png"), "14: image 'a.png' occurs twice"},
      {"b.png - -\n" + make_rows("a.png", 12, 4), "2: the corners lie in rows of 4"},
      {make_rows("a.png", 24, 8), "1: the corners lie in rows of 8", seven_cols}};
  for (const char* const row : {"a 1x 2", "a 2 1x", "a 3 4 1x", "a inf 2", "a nan 2", "a x 2"}) {
    refusals.push_back({row + std::string("\n"), "1: '"});
  }
  for (const char* const name : {"a.png", "a.png-corner", "a.png-corner4", "a.png-corner/",
                                 "a.png-corner01", "a.png-korner0", "a-corner0.png"}) {
    refusals.push_back({std::string(name) + " - -\n", "1: an image of a", synthetic_board(true)});
  }
  for (const auto& [text, line, board] : refusals)
    EXPECT_THAT(rejection(text, board), testing::StartsWith("corners.vnl:" + line)) << text;
  EXPECT_EQ(read("a-corner7 - -\n").size(), 1U) << "a board in one part";
}

}  // namespace
}  // namespace vlp
