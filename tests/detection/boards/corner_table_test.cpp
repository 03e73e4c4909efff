// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/corner_table.h"

#include <gmock/gmock.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "captures/csv_reader.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

constexpr std::array kImager{800, 600};

Board make_board_of_three_tags() {
  return {"tag36h11", 3, 1, 0.02, 1.0, 1, false, 0, {false, BoardCorner::top_left}};
}

/// Returns a table of all corners of three tags in each image; the first `outside` corners are
/// outside the image.
std::string make_corner_table(int images, int outside) {
  std::string text = "image,tag,corner,u_px,v_px\n";
  for (int image = 0; image < images; ++image) {
    for (int corner = 0; corner < 12; ++corner) {
      text += std::to_string(image) + ".png," + std::to_string(corner / 4) + "," +
              std::to_string(corner % 4) + "," + (outside-- > 0 ? "800" : "700") + "," +
              std::to_string(10 * corner) + "\n";
    }
  }
  return text;
}

TEST(ReadCornerTable, RestoresWrittenDetectionsExactly) {
  const TemporaryFolder folder;
  std::vector<BoardView> views{{"a.png", kImager, {}}, {"empty.png", kImager, {}}};
  for (const int id : {2, 0}) {
    TagDetection tag{id, {}};
    for (std::size_t k = 0; k < 4; ++k) {
      tag.corners_px[k] = {100 * id + 20 / 3. * double(k), 1 / 7. + double(k)};
      tag.curvatures[k] = {0.1 / 3 * double(k + 1), -0.02, 0.8};
      tag.corner_sds_px[k] = 0.01 * double(k + 1);
    }
    views[0].detection.tags.push_back(tag);
  }
  TagDetection foreign = views[0].detection.tags[0];
  foreign.id = 7;
  views[0].detection.foreign_tags.push_back(foreign);
  write_corner_table(folder / "corners.csv", views, make_board_of_three_tags());
  const auto read = read_corner_table(folder / "corners.csv", make_board_of_three_tags(), kImager);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].image, "a.png");
  ASSERT_EQ(read[0].detection.tags.size(), 2U);
  for (const std::size_t i : {0U, 1U}) {  // sorted by id
    const TagDetection &found = read[0].detection.tags[i],
                       &written = views[0].detection.tags[1 - i];
    EXPECT_EQ(found.id, written.id);
    EXPECT_EQ(found.corners_px, written.corners_px);
    EXPECT_EQ(found.corner_sds_px, written.corner_sds_px);
    EXPECT_EQ(found.curvatures, written.curvatures);
  }
  ASSERT_EQ(read[0].detection.foreign_tags.size(), 1U);
  EXPECT_EQ(read[0].detection.foreign_tags[0].id, 7);
  EXPECT_EQ(read[1].image, "empty.png");
  EXPECT_TRUE(read[1].detection.tags.empty());
}

Board make_chessboard(int cols, int rows) {
  Board board{"", cols, rows, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = BoardKind::chessboard;
  board.square_size_m = 0.02;
  return board;
}

TEST(ReadCornerTable, RestoresChessboardCornersAndRejectsWrongRowLength) {
  const TemporaryFolder folder;
  std::vector<BoardView> views{{"a.png", kImager, {}}, {"b.png", kImager, {}}};
  for (BoardView& view : views) {
    for (std::size_t i = 0; i < 24; ++i) {
      view.detection.points.push_back(
          {i, {100 + 50 / 3. * double(i % 6), 80 + 40 / 7. * double(i / 6)}});
    }
  }
  const auto file = folder / "corners.csv";
  write_corner_table(file, views, make_chessboard(7, 5));
  const auto read = read_corner_table(file, make_chessboard(7, 5), kImager);
  ASSERT_EQ(read.size(), 2U);
  for (const std::size_t view : {0U, 1U}) {
    const auto& points = read[view].detection.points;
    EXPECT_EQ(read[view].image, views[view].image);
    ASSERT_EQ(points.size(), 24U);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points[i].index, i);
      EXPECT_EQ(points[i].pixel, views[view].detection.points[i].pixel);
    }
  }
  EXPECT_THAT(rejection_message([&] { read_corner_table(file, make_chessboard(5, 7), kImager); }),
              HasSubstr("the corners lie in rows of 6, but a board of 5 x 7 squares has 4 x 6 "
                        "corners; swap cols and rows of board.yaml"));
}

TEST(ReadCornerTable, ToleratesTwoPercentOfCornersOutsideImage) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_corner_table(folder.file("corners.csv", text), make_board_of_three_tags(), kImager);
  };
  const auto views = read(make_corner_table(25, 6));  // 2 % of 300 corners
  ASSERT_EQ(views.size(), 25U);
  EXPECT_EQ(views[0].detection.tags.size(), 3U);
  EXPECT_THAT(rejection_message([&] { read(make_corner_table(25, 7)); }),
              HasSubstr("corners.csv:2: u_px: a corner at (800, 0) is outside an image"));
}

TEST(ReadCornerTable, CountsTagsWithoutAllCornersAndRejectsRepeatedCorner) {
  const TemporaryFolder folder;
  const std::string all = make_corner_table(1, 0);
  const auto read = [&](const std::string& text) {
    return read_corner_table(folder.file("corners.csv", text), make_board_of_three_tags(), kImager);
  };
  const auto views = read(all.substr(0, all.rfind("0.png")));
  ASSERT_EQ(views.size(), 1U);
  EXPECT_EQ(views[0].detection.tags.size(), 2U);
  EXPECT_EQ(views[0].detection.num_unusable_tags, 1);
  EXPECT_THAT(rejection_message([&] { read(all + all.substr(all.rfind("0.png"))); }),
              HasSubstr("corners.csv:14: corner: 3 occurs twice in image '0.png'"));
  EXPECT_THAT(rejection_message([&] { read(all + "0.png,0,4,1,1\n"); }),
              HasSubstr("should be within 0 and 3"));
  EXPECT_THAT(rejection_message([&] { read("image,tag,corner,u_px,v_px\n"); }),
              HasSubstr("contains no corner"));
}

Board make_charuco_board() {
  Board board = make_chessboard(4, 4);
  board.kind = BoardKind::charuco;
  board.family = "DICT_4X4_50";
  board.tag_size_m = 0.015;
  return board;
}

/// Returns the views of a table with the given text.
std::vector<BoardView> read_text(const std::string& text,
                                 const Board& board = make_board_of_three_tags()) {
  const TemporaryFolder folder;
  return read_corner_table(folder.file("corners.csv", text), board, kImager);
}

/// Returns the message for a table with the given text.
std::string reject(const std::string& text, const Board& board = make_board_of_three_tags()) {
  return rejection_message([&] { read_text(text, board); });
}

/// Each table is rejected with file, line and column.
TEST(ReadCornerTable, RejectsInvalidTables) {
  const std::string tags = "image,tag,corner,u_px,v_px\na.png,0,0,1,1\n",
                    squares = "image,corner,u_px,v_px\n", sd = "image,tag,corner,u_px,v_px,sd_px\n",
                    curves =
                        "image,tag,corner,u_px,v_px,edge_quadratic_px,edge_cubic_px,"
                        "edge_half_extent\n";
  for (const auto& [text, where] : std::vector<std::pair<std::string, std::string>>{
           {"image,corner,u_px,v_px\na.png,0,1,1\n", "corners.csv:1: tag: "},
           {"tag,corner,u_px,v_px\n0,0,1,1\n", "corners.csv:1: image: "},
           {"image,tag,u_px,v_px\na.png,0,1,1\n", "corners.csv:1: corner: "},
           {"image,tag,corner,v_px\na.png,0,0,1\n", "corners.csv:1: u_px: "},
           {"image,tag,corner,u_px\na.png,0,0,1\n", "corners.csv:1: v_px: "},
           {tags + ",0,1,1,1\n", "corners.csv:3: image: "},
           {tags + "a.png,0,-1,1,1\n", "corners.csv:3: corner: "},
           {tags + "a.png,0,4,1,1\n", "corners.csv:3: corner: "},
           {tags + "a.png,0,,1,1\n", "corners.csv:3: corner: "},
           {tags + "a.png,,1,1,1\n", "corners.csv:3: tag: "},
           {tags + "a.png,0,1,,1\n", "corners.csv:3: u_px: "},
           {tags + "a.png,0,1,1,\n", "corners.csv:3: v_px: "},
           {tags + "a.png,0,3,1,1\n", ""},
           {sd + "a.png,0,0,1,1,0\n", ""},
           {sd + "a.png,0,0,1,1,-0.01\n", "corners.csv:2: sd_px: "},
           {"image,tag,corner,u_px,v_px,edge_cubic_px\na.png,0,0,1,1,0.1\n",
            "corners.csv:1: edge_half_extent: "},
           {curves + "a.png,0,0,1,1,0.1,0.2,0\n", ""},
           {curves + "a.png,0,0,1,1,0.1,0.2,0.01\n", ""},
           {curves + "a.png,0,0,1,1,0.1,0.2,2\n", ""},
           {curves + "a.png,0,0,1,1,0.1,0.2,0.009\n", "corners.csv:2: edge_half_extent: "},
           {curves + "a.png,0,0,1,1,0.1,0.2,2.1\n", "corners.csv:2: edge_half_extent: "}}) {
    EXPECT_THAT(reject(text), HasSubstr(where)) << text;
    EXPECT_EQ(reject(text).empty(), where.empty()) << text;
  }
  for (const auto& [text, where] : std::vector<std::pair<std::string, std::string>>{
           {squares + "a.png,8,1,1\n", ""},
           {squares + "a.png,9,1,1\n", "corners.csv:2: corner: "},
           {squares + "a.png,-1,1,1\n", "corners.csv:2: corner: "},
           {squares + "a.png,8,1,1\nb.png,8,1,1\nb.png,8,2,1\n", "corners.csv:4: corner: "}}) {
    EXPECT_THAT(reject(text, make_charuco_board()), HasSubstr(where)) << text;
    EXPECT_EQ(reject(text, make_charuco_board()).empty(), where.empty()) << text;
  }
}

TEST(ReadCornerTable, IgnoresIncompleteForeignTags) {
  std::string text = "image,tag,corner,u_px,v_px\n";
  for (int corner = 0; corner < 4; ++corner) {
    text += "a.png,9," + std::to_string(corner) + ",1,1\n";
  }
  const auto views = read_text(text + "a.png,8,0,1,1\na.png,1,0,1,1\n");
  ASSERT_EQ(views.size(), 1U);
  EXPECT_TRUE(views[0].detection.tags.empty());
  EXPECT_EQ(views[0].detection.num_unusable_tags, 1);
  ASSERT_EQ(views[0].detection.foreign_tags.size(), 1U);
  EXPECT_EQ(views[0].detection.foreign_tags[0].id, 9);
}

TEST(ReadCornerTable, SortsPointsOfSquaresAndCountsRowsDownwards) {
  const std::string header = "image,corner,u_px,v_px\n";
  const auto views = read_text(
      header + "b.png,4,200,200\nb.png,0,100,100\nb.png,1,200,100\nb.png,3,100,200\na.png,,,\n",
      make_charuco_board());
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[0].image, "b.png");
  EXPECT_EQ(views[0].imager_px, kImager);
  const auto& points = views[0].detection.points;
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points[1].index, 1U);
  EXPECT_EQ(points[3].index, 4U);
  EXPECT_EQ(points[3].pixel, Eigen::Vector2d(200, 200));
  EXPECT_TRUE(views[1].detection.points.empty());
  // Rows that are counted upwards.
  const auto upwards =
      read_text(header + "b.png,0,100,300\nb.png,1,200,300\nb.png,3,100,200\nb.png,6,100,100\n",
                make_charuco_board());
  ASSERT_EQ(upwards.size(), 1U);
  ASSERT_EQ(upwards[0].detection.points.size(), 4U);
  EXPECT_EQ(upwards[0].detection.points[0].pixel, Eigen::Vector2d(100, 100));
  EXPECT_EQ(upwards[0].detection.points[3].index, 7U);
  EXPECT_EQ(upwards[0].detection.points[3].pixel, Eigen::Vector2d(200, 300));
}

/// Only rows of chessboards are rotated: the markers of other boards determine their orientation.
TEST(ReadCornerTable, RotatesOnlyChessboardsBy180Degrees) {
  std::string text = "image,corner,u_px,v_px\n";
  for (int i = 0; i < 9; ++i) {
    text += "a.png," + std::to_string(i) + "," + std::to_string(400 - 100 * (i % 3)) + "," +
            std::to_string(400 - 100 * (i / 3)) + "\n";
  }
  Board chessboard = make_charuco_board();
  chessboard.kind = BoardKind::chessboard;
  const auto kept = read_text(text, make_charuco_board()), rotated = read_text(text, chessboard);
  ASSERT_TRUE(kept.size() == 1 && rotated.size() == 1);
  ASSERT_EQ(kept[0].detection.points.size(), 9U);
  ASSERT_EQ(rotated[0].detection.points.size(), 9U);
  EXPECT_EQ(kept[0].detection.points[0].pixel, Eigen::Vector2d(400, 400));
  EXPECT_EQ(rotated[0].detection.points[0].pixel, Eigen::Vector2d(200, 200));
}

TEST(WriteCornerTable, WritesRowWithNameOnlyForImageWithoutCorners) {
  const TemporaryFolder folder;
  const std::vector<BoardView> views{{"a.png", kImager, {}}, {"b.png", kImager, {}}};
  for (const Board& board : {make_board_of_three_tags(), make_charuco_board()}) {
    write_corner_table(folder / "corners.csv", views, board);
    const auto read = read_corner_table(folder / "corners.csv", board, kImager);
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[1].image, "b.png");
    EXPECT_FALSE(read[1].detection.has_corners());
  }
}

TEST(WriteCornerTable, WritesViewThatHasOnlyForeignTags) {
  const TemporaryFolder folder;
  std::vector<BoardView> views{{"a.png", kImager, {}}};
  TagDetection foreign{7, {}};
  foreign.corners_px.fill({5, 6});
  views[0].detection.foreign_tags.push_back(foreign);
  write_corner_table(folder / "corners.csv", views, make_board_of_three_tags());
  const CsvTable table(folder / "corners.csv");
  EXPECT_EQ(table.num_rows(), 4U);
  EXPECT_EQ(table.get_cell_text(0, table.require_column("tag")), "7");
}

}  // namespace
}  // namespace vlp
