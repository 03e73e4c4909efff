// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_lattice.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

/// Returns points of a part of a board: `cols` points in each of `rows` rows.
BoardDetection make_points_of_part(const BoardLattice& lattice, std::size_t part, int cols,
                                   int rows) {
  BoardDetection seen;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      seen.points.push_back({part * lattice.points_per_part() +
                                 static_cast<std::size_t>(row * lattice.lattice_cols() + col),
                             {10. * col, 10. * row}});
    }
  }
  return seen;
}

TEST(BoardLattice, PoseOfContiguousLatticeNeedsTwelvePointsInTwoRows) {
  const BoardLattice lattice(synthetic_board(false));
  ASSERT_EQ(lattice.num_board_parts(), 1U);
  EXPECT_TRUE(lattice.can_determine_pose(make_points_of_part(lattice, 0, 6, 2)));
  EXPECT_TRUE(lattice.can_determine_pose(make_points_of_part(lattice, 0, 2, 6)));
  EXPECT_FALSE(lattice.can_determine_pose(make_points_of_part(lattice, 0, 1, 9)));
  EXPECT_FALSE(lattice.can_determine_pose(make_points_of_part(lattice, 0, 12, 1)));
  BoardDetection eleven = make_points_of_part(lattice, 0, 6, 2);
  eleven.points.pop_back();
  EXPECT_FALSE(lattice.can_determine_pose(eleven));
}

TEST(BoardLattice, PoseOfSpacedTagsNeedsSixPointsOfEachCornerKind) {
  const BoardLattice lattice(synthetic_board(true));
  ASSERT_EQ(lattice.num_board_parts(), 4U);
  BoardDetection seen;
  for (std::size_t part = 0; part < 4; ++part) {
    EXPECT_FALSE(lattice.can_determine_pose(seen)) << "part " << part << " is missing";
    const BoardDetection more = make_points_of_part(lattice, part, 3, 2);
    seen.points.insert(seen.points.end(), more.points.begin(), more.points.end());
  }
  EXPECT_TRUE(lattice.can_determine_pose(seen));
  seen.points.pop_back();
  EXPECT_FALSE(lattice.can_determine_pose(seen));
}

/// Board of 4 x 3 tags of 20 mm with gaps of 5 mm, and ids from 7 at the top left along columns.
Board spaced_board() {
  Board board = synthetic_board(true);
  board.cols = 4;
  board.rows = 3;
  board.tag_spacing = 0.25;
  board.first_id = 7;
  board.id_order = {true, BoardCorner::top_left};
  return board;
}

Board squares_board() {
  Board board = synthetic_board(false);
  board.kind = BoardKind::chessboard;
  board.cols = 8;
  board.rows = 6;
  board.square_size_m = 0.03;
  return board;
}

TEST(BoardLattice, ContiguousTagsFormOneLattice) {
  const BoardLattice lattice(synthetic_board(false));
  EXPECT_EQ(lattice.num_board_parts(), 1U);
  EXPECT_EQ(lattice.lattice_cols(), 12);
  EXPECT_EQ(lattice.lattice_rows(), 10);
  EXPECT_EQ(lattice.points_per_part(), 120U);
  EXPECT_DOUBLE_EQ(lattice.point_spacing_m(), 0.02);
  EXPECT_NEAR(lattice.board_to_part_warp_ratio().x(), 1, 1e-12);
  EXPECT_NEAR(lattice.board_to_part_warp_ratio().y(), 1, 1e-12);
  EXPECT_EQ(lattice.get_tag_of_point(0), 0U);
  EXPECT_EQ(lattice.get_tag_of_point(11), 5U);
  EXPECT_EQ(lattice.get_tag_of_point(13), 0U);
  EXPECT_EQ(lattice.get_tag_of_point(3 * 12 + 5), 8U) << "row 1, column 2";
  EXPECT_EQ(lattice.get_tag_of_point(119), 29U);
}

TEST(BoardLattice, SpacedTagsFormFourLattices) {
  const BoardLattice lattice(spaced_board());
  EXPECT_EQ(lattice.num_board_parts(), 4U);
  EXPECT_EQ(lattice.lattice_cols(), 4);
  EXPECT_EQ(lattice.lattice_rows(), 3);
  EXPECT_DOUBLE_EQ(lattice.point_spacing_m(), 0.025);
  // The board is 95 x 70 mm, a part 75 x 50 mm.
  EXPECT_NEAR(lattice.board_to_part_warp_ratio().x(), std::pow(95 / 75.0, 2), 1e-12);
  EXPECT_NEAR(lattice.board_to_part_warp_ratio().y(), std::pow(70 / 50.0, 2), 1e-12);
  EXPECT_EQ(lattice.board_point_index(2, 5), 29U);
  EXPECT_EQ(lattice.get_tag_of_point(7), 7U);
}

TEST(BoardLattice, ThrowsForSingleRowOrColumnOfSpacedTags) {
  Board row = spaced_board(), column = spaced_board();
  row.rows = 1;
  column.cols = 1;
  EXPECT_THROW(BoardLattice{row}, std::invalid_argument);
  EXPECT_THROW(BoardLattice{column}, std::invalid_argument);
  try {
    const BoardLattice lattice(row);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "a board of one row of tags needs tag_spacing 1");
  }
  row.tag_spacing = column.tag_spacing = 1;
  EXPECT_EQ(BoardLattice(row).lattice_rows(), 2);
  EXPECT_EQ(BoardLattice(column).lattice_cols(), 2);
  Board smallest = spaced_board();
  smallest.cols = smallest.rows = 2;
  EXPECT_EQ(BoardLattice(smallest).num_board_parts(), 4U);
}

/// Returns the tag with this id whose image has its corners at these pixels, with distinct values
/// of all other fields.
TagDetection make_tag_with_all_fields(int id, const TagDetection::Corners& corners_px) {
  TagDetection tag{id, corners_px};
  for (std::size_t k = 0; k < 4; ++k) {
    tag.curvatures[k] = {0.1 * static_cast<double>(k), 0.2, 1.1};
    tag.corner_sds_px[k] = 0.01 * static_cast<double>(k + 1);
  }
  return tag;
}

TEST(BoardLattice, ListsCornersOfContiguousTags) {
  const Board board = synthetic_board(false);  // ids from the bottom left along rows
  const BoardLattice lattice(board);
  const TagDetection tag = make_tag_with_all_fields(8, {{{10, 90}, {50, 90}, {50, 20}, {10, 20}}});
  const auto corners = lattice.list_corners({{tag}});
  ASSERT_EQ(corners.size(), 4U);
  // Tag 8: column 2 of row 3 from the top.
  const std::array<std::size_t, 4> points{7 * 12 + 4, 7 * 12 + 5, 6 * 12 + 5, 6 * 12 + 4};
  const std::array<Eigen::Vector3d, 4> positions_m{
      {{0.08, 0.14, 0}, {0.10, 0.14, 0}, {0.10, 0.12, 0}, {0.08, 0.12, 0}}};
  // Both edges of a corner move inwards by 1 px.
  const std::array<Eigen::Vector2d, 4> inward{{{1, -1}, {-1, -1}, {-1, 1}, {1, 1}}};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(corners[k].part, 0U);
    EXPECT_EQ(corners[k].point, points[k]);
    EXPECT_LT((corners[k].in_board_m - positions_m[k]).norm(), 1e-12);
    EXPECT_EQ(corners[k].pixel, tag.corners_px[k]);
    EXPECT_LT((corners[k].d_pixel_d_edge_shift - inward[k]).norm(), 1e-12);
    EXPECT_EQ(corners[k].weight, 1);
    EXPECT_EQ(corners[k].curvature, tag.curvatures[k]);
    EXPECT_EQ(corners[k].sd_px, tag.corner_sds_px[k]);
  }
}

TEST(BoardLattice, InwardDisplacementMovesBothEdgesOfObliqueTagByOnePixel) {
  // Both directions of rotation, and no right angles.
  const TagDetection::Corners corners_px{{{12, 95}, {60, 80}, {75, 15}, {5, 30}}};
  for (const bool mirrored : {false, true}) {
    TagDetection tag{0, corners_px};
    if (mirrored) {
      for (auto& corner : tag.corners_px) corner.x() = 100 - corner.x();
    }
    const auto corners = BoardLattice(synthetic_board(false)).list_corners({{tag}});
    ASSERT_EQ(corners.size(), 4U);
    const Eigen::Vector2d middle_px =
        (tag.corners_px[0] + tag.corners_px[1] + tag.corners_px[2] + tag.corners_px[3]) / 4;
    for (std::size_t k = 0; k < 4; ++k) {
      for (const std::size_t other : {(k + 1) % 4, (k + 3) % 4}) {
        const Eigen::Vector2d along = (tag.corners_px[other] - tag.corners_px[k]).normalized();
        const auto distance = [&](const Eigen::Vector2d& v) {
          return along.x() * v.y() - along.y() * v.x();
        };
        const double sign = distance(middle_px - tag.corners_px[k]) > 0 ? 1 : -1;
        EXPECT_NEAR(sign * distance(corners[k].d_pixel_d_edge_shift), 1, 1e-12);
      }
    }
  }
}

TEST(BoardLattice, ListsPointsOfBoardOfSquares) {
  const BoardLattice lattice(squares_board());
  BoardDetection seen;
  seen.points = {{9, {30, 40}, 0.02, 0.5}, {34, {50, 60}}};
  const auto corners = lattice.list_corners(seen);
  ASSERT_EQ(corners.size(), 2U);
  EXPECT_EQ(corners[0].part, 0U);
  EXPECT_EQ(corners[0].point, 9U);
  EXPECT_LT((corners[0].in_board_m - Eigen::Vector3d(0.06, 0.03, 0)).norm(), 1e-12);
  EXPECT_EQ(corners[0].pixel, Eigen::Vector2d(30, 40));
  EXPECT_EQ(corners[0].weight, 0.5);
  EXPECT_EQ(corners[0].sd_px, 0.02);
  EXPECT_EQ(corners[0].d_pixel_d_edge_shift, Eigen::Vector2d::Zero());
  EXPECT_LT((corners[1].in_board_m - Eigen::Vector3d(0.18, 0.12, 0)).norm(), 1e-12);
  EXPECT_EQ(corners[1].weight, 1);
}

}  // namespace
}  // namespace vlp
