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
    input.views.push_back(input.lattice.list_corners_with_board_positions(view.detection));
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
  EXPECT_LT(
      compute_projection_difference(solution.fitted_lens(), again.fitted_lens(), kImager_px, even)
          .value()
          .worst_px,
      1e-3);
  EXPECT_NEAR(again.rms_px, solution.rms_px, 1e-5);
}

/// Images of two folders with the same names.
TEST_P(WriteMrcalCorners, AppendsNumbersToRepeatedImageNames) {
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
    EXPECT_TRUE(view.detection.has_detected_corners());
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
  EXPECT_FALSE(by_level[1].detection.has_detected_corners());
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

TEST(ReadMrcalCorners, ThrowsForWeightAbove1000) {
  const TemporaryFolder folder;
  const auto file = folder.file("corners.vnl", "# filename x y weight\n" + row("100 100", "1e7"));
  EXPECT_EQ(rejection_message([&] { read_mrcal_corners(file, chessboard(), kImager_px); }),
            file.string() + ":2: a weight of 1e+07: weights go up to 1000");
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

/// With either solver, corners with large errors and small weights have little influence.
TEST(CornerWeight, SmallWeightsKeepSolvedLensAccurateDespiteCornerErrors) {
  const std::array fisheye{450.0, 451.0, 402.0, 297.0, 0.02, -0.01, 0.003, -0.0004};
  for (const Lens& lens : {synthetic_lens(), Lens(LensModel::fisheye, fisheye)}) {
    SCOPED_TRACE(lens_model_name(lens.lens_model()));
    const SyntheticViews views{synthetic_board(false), lens};
    Random random(5);
    IntrinsicsInput input = views.input(16, random, 0.05);
    input.warp = WarpChoice::off;
    for (auto& view : input.views) {
      for (auto& corner : view) corner.d_pixel_d_edge_shift.setZero();
    }
    const IntrinsicsSolution whole = solve_intrinsics(input);
    IntrinsicsInput weighted = input;
    for (auto& view : weighted.views) {
      for (auto& corner : view) corner.weight = 0.5;
    }
    const IntrinsicsSolution half = solve_intrinsics(weighted);
    ASSERT_TRUE(whole.has_succeeded() && half.has_succeeded());
    EXPECT_NEAR(half.rms_px, whole.rms_px / 2, 0.02 * whole.rms_px);
    // Every second corner has errors of a pixel, with a fiftieth of the weight.
    for (auto& view : input.views) {
      for (std::size_t i = 0; i < view.size(); i += 2) {
        view[i].pixel += Eigen::Vector2d{random.normal(), random.normal()};
        view[i].weight = 0.02;
      }
    }
    const IntrinsicsSolution spoilt = solve_intrinsics(input);
    ASSERT_TRUE(spoilt.has_succeeded());
    EXPECT_LT(
        compute_projection_difference(lens, spoilt.fitted_lens(), kImager_px, even).value().mean_px,
        0.1);
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

TEST_F(ReadMrcalCornerText, RejectsTextThatIsCutShort) {
  std::string rows = make_rows("a.png", 12, 3, "\t1");
  rows.pop_back();
  EXPECT_NE(rejection(rows).find("the last line has no end"), std::string::npos);
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

TEST_F(ReadMrcalCornerText, WeightIsPowerOfWholeLevel) {
  for (const auto& [level, weight] : std::vector<std::pair<std::string, double>>{
           {"0.9", 1}, {"1.9", 0.5}, {"2", 0.25}, {"30", std::pow(0.5, 30)}}) {
    const auto views = read(make_rows("a.png", 12, 3, " " + level));
    ASSERT_EQ(views.size(), 1U);
    ASSERT_EQ(views[0].detection.points.size(), 12U);
    EXPECT_EQ(views[0].detection.points[7].weight, weight);
  }
  EXPECT_EQ(rejection(make_rows("a.png", 12, 3, " 30.5")),
            "corners.vnl:1: a level should be within 0 and 30");
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
  EXPECT_EQ(rejection(legend + make_rows("a.png", 12, 3, " 1000.5")),
            "corners.vnl:2: a weight of 1000.5: weights go up to 1000");
  for (const char* const unseen : {" 0", " -1", " -"}) {
    const auto none = read(legend + make_rows("a.png", 12, 3, unseen));
    ASSERT_EQ(none.size(), 1U);
    EXPECT_TRUE(none[0].detection.points.empty()) << unseen;
  }
}

TEST_F(ReadMrcalCornerText, RejectsTextsThatAreNoTable) {
  EXPECT_EQ(rejection("\n"), "corners.vnl: contains no corner");
  EXPECT_EQ(rejection("# filename x y level\n\n"), "corners.vnl: contains no corner");
  for (const char* const row : {"a.png 1", "a.png 1 2 3 4"}) {
    EXPECT_EQ(rejection("\n" + std::string(row) + "\n"),
              "corners.vnl:2: should be: filename x y level; is it mrcal's table of corners?");
  }
  for (const char* const row : {"a 1x 2", "a 2 1x", "a 3 4 1x"}) {
    EXPECT_EQ(rejection(std::string(row) + "\n"),
              "corners.vnl:1: '1x' should be a finite number, or -");
  }
  for (const char* const row : {"a inf 2", "a nan 2", "a x 2"}) {
    EXPECT_NE(rejection(row + std::string("\n")).find("should be a finite number, or -"),
              std::string::npos)
        << row;
  }
}

TEST_F(ReadMrcalCornerText, RejectsManyCornersOutsideImage) {
  std::string rows = make_rows("a.png");
  const std::string first = make_rows("a.png", 1);
  std::string images;
  for (const char* const name :
       {"b.png", "c.png", "d.png", "e.png", "f.png", "g.png", "h.png", "i.png", "j.png"}) {
    images += make_rows(name);
  }
  EXPECT_EQ(read(images + "a.png 900 200\n" + rows.substr(first.size())).size(), 10U)
      << "few corners may be outside the image";
  for (const char* const from : {"a.png 100", "a.png 140", "a.png 180"}) {
    for (std::size_t at = 0; (at = rows.find(from, at)) != rows.npos;)
      rows.replace(at + 6, 3, "900");
  }
  EXPECT_EQ(rejection("\n" + rows).substr(0, 40), "corners.vnl:2: a corner at (900, 200) is");
}

TEST_F(ReadMrcalCornerText, RejectsWrongNumberOfRows) {
  const auto message = [&](int count, const Board& board) {
    return rejection("# filename x y\nb.png - -\n" + make_rows("a.png", count), board);
  };
  EXPECT_EQ(message(11, chessboard()),
            "corners.vnl:3: image 'a.png' has 11 rows, but a board of 4 x 5 squares has 3 x 4 "
            "corners; is the file cut short, or of another board?");
  EXPECT_EQ(message(1, chessboard()),
            "corners.vnl:3: image 'a.png' has 1 rows, but a board of 4 x 5 squares has 3 x 4 "
            "corners; is the file cut short, or of another board?");
  EXPECT_EQ(message(20, chessboard()),
            "corners.vnl:3: image 'a.png' has 20 rows, but a board of 4 x 5 squares has 3 x 4 "
            "corners; cols and rows of board.yaml count squares, not the corners between them: "
            "cols 5, rows 6");
  EXPECT_EQ(message(30, synthetic_board(false)),
            "corners.vnl:3: image 'a.png' has 30 rows, but a board of 6 x 5 tags has 12 x 10 "
            "corners; is the file cut short, or of another board?");
  std::string part = make_rows("a.png-corner0", 29);
  EXPECT_EQ(rejection(part, synthetic_board(true)),
            "corners.vnl:1: image 'a.png-corner0' has 29 rows, but a board of 6 x 5 tags has 6 x "
            "5 corners of each kind; is the file cut short, or of another board?");
}

TEST_F(ReadMrcalCornerText, RejectsRepeatedImage) {
  EXPECT_EQ(rejection(make_rows("a.png") + "b.png - -\n" + make_rows("a.png")),
            "corners.vnl:14: image 'a.png' occurs twice");
}

TEST_F(ReadMrcalCornerText, RejectsRowsOfAnotherLength) {
  // The corners lie in four columns of three.
  EXPECT_EQ(rejection("b.png - -\n" + make_rows("a.png", 12, 4)),
            "corners.vnl:2: the corners lie in rows of 4, but a board of 4 x 5 squares has 3 x 4 "
            "corners; swap cols and rows of board.yaml");
  Board board = chessboard();
  board.cols = 7;
  EXPECT_EQ(rejection(make_rows("a.png", 24, 8), board),
            "corners.vnl:1: the corners lie in rows of 8, but a board of 7 x 5 squares has 6 x 4 "
            "corners; is board.yaml that of the board?");
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

TEST_F(ReadMrcalCornerText, RejectsNamesOfPartsOfImage) {
  for (const char* const name : {"a.png", "a.png-corner", "a.png-corner4", "a.png-corner/",
                                 "a.png-corner01", "a.png-korner0", "a-corner0.png"}) {
    EXPECT_EQ(rejection(std::string(name) + " - -\n", synthetic_board(true)),
              "corners.vnl:1: an image of a board whose gaps differ from its tag width needs four "
              "entries, NAME-corner0 to NAME-corner3, as vlp-intrinsics writes them");
  }
  EXPECT_EQ(read("a-corner7 - -\n").size(), 1U) << "a board in one part";
}

TEST_F(ReadMrcalCornerText, RenumbersCornersFromTopLeftOfBoardInOnePart) {
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

/// Returns a solution of 2 x 2 points on each of the boards of views 2 and 0.
IntrinsicsSolution make_solution_of_four_points(std::size_t parts) {
  IntrinsicsSolution solution{};
  solution.views = {2, 0};
  BoardProblem& problem = solution.problem;
  problem.cols = problem.rows = 2;
  problem.poses.resize(2 * parts);
  for (std::size_t i = 0; i < 8 * parts; ++i) {
    const auto number = static_cast<double>(i);
    problem.points.emplace_back(100.5 + number, 0.1 * number, i % 4 == 2 ? -1 : 0.25);
  }
  return solution;
}

const std::vector<std::string> kThreeImages{"a b.png", "unused.png", "c.png"};

TEST(WriteMrcalCornerText, WritesLevelsAndMissingCorners) {
  const TemporaryFolder folder;
  write_mrcal_corners(folder / "corners.vnl", make_solution_of_four_points(1), kThreeImages);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "corners.vnl"),
            "# filename x y level\n"
            "c.png 100.5 0 2\n"
            "c.png 101.5 0.10000000000000001 2\n"
            "c.png -1 -1 -\n"
            "c.png 103.5 0.30000000000000004 2\n"
            "a_b.png 104.5 0.40000000000000002 2\n"
            "a_b.png 105.5 0.5 2\n"
            "a_b.png -1 -1 -\n"
            "a_b.png 107.5 0.70000000000000007 2\n");
}

TEST(WriteMrcalCornerText, WritesWeightsUnlessAllAreWholeLevels) {
  const TemporaryFolder folder;
  const auto written = [&](double weight) {
    IntrinsicsSolution solution = make_solution_of_four_points(1);
    solution.problem.points[5].z() = weight;
    write_mrcal_corners(folder / "corners.vnl", solution, kThreeImages);
    return TemporaryFolder::read_content(folder / "corners.vnl");
  };
  for (const char* const weight : {"0.3", "2", "4"}) {
    const std::string text = written(std::stod(weight));
    EXPECT_TRUE(text.starts_with("# filename x y weight\nc.png 100.5 0 0.25\n")) << text;
    EXPECT_NE(text.find("a_b.png 105.5 0.5 " + std::string(weight) + "\n"), text.npos);
  }
  EXPECT_TRUE(written(1).starts_with("# filename x y level\n"));
  EXPECT_NE(written(1).find("a_b.png 105.5 0.5 0\n"), std::string::npos);
  EXPECT_TRUE(written(-0.3).starts_with("# filename x y level\n")) << "an outlier";
}

TEST(WriteMrcalCornerText, AppendsPartToNameForBoardInFourParts) {
  const TemporaryFolder folder;
  write_mrcal_corners(folder / "corners.vnl", make_solution_of_four_points(4), kThreeImages);
  const std::string text = TemporaryFolder::read_content(folder / "corners.vnl");
  std::size_t from = text.find('\n') + 1;
  for (int i = 0; i < 32; ++i) {
    const std::string name =
        (i < 16 ? "c.png-corner" : "a_b.png-corner") + std::to_string(i / 4 % 4) + " ";
    EXPECT_EQ(text.substr(from, name.size()), name) << i;
    from = text.find('\n', from) + 1;
  }
  EXPECT_EQ(from, text.size());
}

}  // namespace
}  // namespace vlp
