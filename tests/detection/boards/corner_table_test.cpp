// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/corner_table.h"

#include <gmock/gmock.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

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

TEST(DescribeCornerOutsideImage, AcceptsCornersUpToBordersOfPixels) {
  const auto is_accepted = [](double u_px, double v_px) {
    return describe_corner_outside_image({u_px, v_px}, kImager).empty();
  };
  EXPECT_TRUE(is_accepted(-0.5, -0.5));
  EXPECT_TRUE(is_accepted(799.5, 599.5));
  for (const auto& [u_px, v_px] :
       {std::pair(-0.51, 0.0), {0.0, -0.51}, {799.51, 0.0}, {0.0, 599.51}}) {
    EXPECT_FALSE(is_accepted(u_px, v_px)) << u_px << " " << v_px;
  }
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

}  // namespace
}  // namespace vlp
