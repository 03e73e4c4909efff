// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_lattice.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

/// Returns points of a part of a board: `cols` points in each of `rows` rows.
BoardDetection make_points_of_part(const BoardLattice& lattice, std::size_t part, int cols,
                                   int rows) {
  BoardDetection seen;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      seen.points.push_back({part * lattice.num_points_per_part() +
                                 static_cast<std::size_t>(row * lattice.lattice_cols() + col),
                             {10. * col, 10. * row}});
    }
  }
  return seen;
}

TEST(BoardLattice, TwelvePointsInTwoRowsDeterminePoseOfBoardInOnePart) {
  const BoardLattice lattice(synthetic_board(false));
  ASSERT_EQ(lattice.num_board_parts(), 1U);
  EXPECT_TRUE(lattice.are_corners_sufficient_for_pose(make_points_of_part(lattice, 0, 6, 2)));
  EXPECT_TRUE(lattice.are_corners_sufficient_for_pose(make_points_of_part(lattice, 0, 2, 6)));
  EXPECT_FALSE(lattice.are_corners_sufficient_for_pose(make_points_of_part(lattice, 0, 1, 9)));
  EXPECT_FALSE(lattice.are_corners_sufficient_for_pose(make_points_of_part(lattice, 0, 12, 1)));
  BoardDetection eleven = make_points_of_part(lattice, 0, 6, 2);
  eleven.points.pop_back();
  EXPECT_FALSE(lattice.are_corners_sufficient_for_pose(eleven));
}

TEST(BoardLattice, SixPointsOfEachPartDeterminePoseOfBoardInFourParts) {
  const BoardLattice lattice(synthetic_board(true));
  ASSERT_EQ(lattice.num_board_parts(), 4U);
  BoardDetection seen;
  for (std::size_t part = 0; part < 4; ++part) {
    EXPECT_FALSE(lattice.are_corners_sufficient_for_pose(seen)) << "part " << part << " is missing";
    const BoardDetection more = make_points_of_part(lattice, part, 3, 2);
    seen.points.insert(seen.points.end(), more.points.begin(), more.points.end());
  }
  EXPECT_TRUE(lattice.are_corners_sufficient_for_pose(seen));
  seen.points.pop_back();
  EXPECT_FALSE(lattice.are_corners_sufficient_for_pose(seen));
}

}  // namespace
}  // namespace vlp
