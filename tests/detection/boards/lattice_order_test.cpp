// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/lattice_order.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace vlp {
namespace {

/// Node of a lattice, counted from the top left of the image.
struct Node {
  int col, row;
};

/// Creates the points of a lattice whose rows point along `right` in the image. `index_of` numbers
/// them.
std::vector<PointDetection> make_points(int cols, int rows,
                                        const std::function<int(Node)>& index_of,
                                        const Eigen::Vector2d& right = {10, 2},
                                        const Eigen::Vector2d& down = {-3, 12}) {
  std::vector<PointDetection> points(static_cast<std::size_t>(cols * rows));
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const auto index = static_cast<std::size_t>(index_of({col, row}));
      points[index] = {index, right * col + down * row};
    }
  }
  return points;
}

/// Expects points numbered row by row from the top left.
void expect_numbered_from_top_left(const std::vector<PointDetection>& points, int cols,
                                   const Eigen::Vector2d& right = {10, 2},
                                   const Eigen::Vector2d& down = {-3, 12}) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].index, i);
    const int index = static_cast<int>(i);
    EXPECT_EQ(points[i].pixel, right * (index % cols) + down * (index / cols)) << i;
  }
}

TEST(RenumberLatticePoints, CountsRowsDownwards) {
  for (const bool is_symmetric : {false, true}) {
    auto points = make_points(4, 3, [](Node node) { return 4 * node.row + node.col; });
    renumber_lattice_points(points, 4, 3, is_symmetric);
    expect_numbered_from_top_left(points, 4);
    points = make_points(4, 3, [](Node node) { return 4 * (2 - node.row) + node.col; });
    renumber_lattice_points(points, 4, 3, is_symmetric);
    expect_numbered_from_top_left(points, 4);
  }
}

TEST(RenumberLatticePoints, RotatesOnlySymmetricLatticesBy180Degrees) {
  const auto make_rotated = [] {
    return make_points(5, 3, [](Node node) { return 14 - 5 * node.row - node.col; });
  };
  auto points = make_rotated();
  renumber_lattice_points(points, 5, 3, true);
  expect_numbered_from_top_left(points, 5);
  points = make_rotated();
  renumber_lattice_points(points, 5, 3, false);
  EXPECT_EQ(points[0].pixel, make_rotated()[0].pixel);
  EXPECT_EQ(points[14].pixel, make_rotated()[14].pixel);
}

TEST(RenumberLatticePoints, RotatesSquareLatticesBy90Degrees) {
  const std::array<std::function<int(Node)>, 8> numberings{
      [](Node node) { return 3 * node.row + node.col; },
      [](Node node) { return 3 * (2 - node.row) + node.col; },
      [](Node node) { return 3 * node.row + 2 - node.col; },
      [](Node node) { return 3 * (2 - node.row) + 2 - node.col; },
      [](Node node) { return 3 * node.col + node.row; },
      [](Node node) { return 3 * (2 - node.col) + node.row; },
      [](Node node) { return 3 * node.col + 2 - node.row; },
      [](Node node) { return 3 * (2 - node.col) + 2 - node.row; }};
  for (std::size_t i = 0; i < numberings.size(); ++i) {
    SCOPED_TRACE(i);
    auto points = make_points(3, 3, numberings[i]);
    renumber_lattice_points(points, 3, 3, true);
    expect_numbered_from_top_left(points, 3);
  }
}

TEST(RenumberLatticePoints, KeepsOrderOfNonSquareLatticeWithSteepRows) {
  const Eigen::Vector2d right(2, 10), down(-12, 3);
  auto points = make_points(
      4, 3, [](Node node) { return 4 * node.row + node.col; }, right, down);
  renumber_lattice_points(points, 4, 3, true);
  expect_numbered_from_top_left(points, 4, right, down);
}

// The last point of a row and the first one of the next row have successive indices.
TEST(RenumberLatticePoints, IgnoresStepFromRowToRow) {
  const auto all = make_points(4, 3, [](Node node) { return 4 * node.row + node.col; });
  std::vector<PointDetection> points;
  for (const std::size_t i : {3U, 4U, 5U, 7U, 8U}) points.push_back(all[i]);
  renumber_lattice_points(points, 4, 3, true);
  ASSERT_EQ(points.size(), 5U);
  EXPECT_EQ(points[0].index, 3U);
  EXPECT_EQ(points[0].pixel, all[3].pixel);
  EXPECT_EQ(points[4].index, 8U);
}

// Rows have one pair of neighbors, columns six. The columns are steeper than the rows.
TEST(RenumberLatticePoints, ComparesMeanDirectionsOfRowsAndColumns) {
  const auto all =
      make_points(3, 3, [](Node node) { return 3 * node.row + node.col; }, {10, -4}, {6, 9});
  std::vector<PointDetection> points;
  for (const std::size_t i : {0U, 2U, 3U, 5U, 6U, 7U}) points.push_back(all[i]);
  renumber_lattice_points(points, 3, 3, true);
  ASSERT_EQ(points.size(), 6U);
  EXPECT_EQ(points[0].index, 0U);
  EXPECT_EQ(points[5].index, 7U);
  EXPECT_EQ(points[5].pixel, all[7].pixel);
}

TEST(RenumberLatticePoints, RotatesPartOfLattice) {
  const auto all = make_points(4, 3, [](Node node) { return 11 - 4 * node.row - node.col; });
  std::vector<PointDetection> points{all[2], all[3], all[6]};
  renumber_lattice_points(points, 4, 3, true);
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0].index, 5U);
  EXPECT_EQ(points[0].pixel, all[6].pixel);
  EXPECT_EQ(points[1].index, 8U);
  EXPECT_EQ(points[1].pixel, all[3].pixel);
  EXPECT_EQ(points[2].index, 9U);
  EXPECT_EQ(points[2].pixel, all[2].pixel);
}

using Images = std::vector<LatticePixels>;

LatticePixels make_lattice(std::size_t cols, std::size_t rows) {
  LatticePixels pixels;
  for (std::size_t i = 0; i < cols * rows; ++i) {
    const double col = double(i % cols), row = double(i / cols);
    pixels.emplace_back(Eigen::Vector2d(20 * col + 0.1 * col * col, 25 * row - 0.2 * col));
  }
  return pixels;
}

TEST(EstimatePointsPerLatticeRow, ReturnsLengthOfRows) {
  for (const std::size_t cols : {3U, 4U, 6U, 8U}) {
    const std::vector images{make_lattice(cols, 24 / cols), make_lattice(cols, 24 / cols)};
    for (const std::size_t stated : {3U, 4U, 6U, 8U}) {
      const std::size_t expected = cols % stated == 0 ? stated : cols;  // parts of rows are even
      EXPECT_EQ(estimate_points_per_lattice_row(images, stated), expected) << cols << stated;
    }
  }
}

TEST(EstimatePointsPerLatticeRow, ReturnsStatedLengthWithoutImagesOrNeighbors) {
  EXPECT_EQ(estimate_points_per_lattice_row({}, 7), 7U);
  LatticePixels sparse = make_lattice(6, 4);
  for (std::size_t i = 0; i < sparse.size(); i += 2) sparse[i].reset();
  EXPECT_EQ(estimate_points_per_lattice_row(Images{sparse}, 8), 8U);
}

/// Returns twelve pixels on a line with given second differences.
LatticePixels make_line(const std::array<double, 12>& second_differences_px) {
  LatticePixels pixels{Eigen::Vector2d(0, 0), Eigen::Vector2d(10, 0)};
  for (std::size_t i = 2; i < 12; ++i) {
    pixels.emplace_back(2 * *pixels[i - 1] - *pixels[i - 2] +
                        Eigen::Vector2d(second_differences_px[i], 0));
  }
  return pixels;
}

// Rows of three use the second differences 2, 5, 8 and 11, rows of four 2, 3, 6, 7, 10 and 11.
TEST(EstimatePointsPerLatticeRow, RequiresHalfTheUnevennessOfStatedLength) {
  const auto estimate = [](double of_three_px, double of_four_px, std::size_t stated) {
    const double a = of_three_px, b = of_four_px;
    return estimate_points_per_lattice_row(Images{make_line({0, 0, 1, b, 9, a, b, b, a, 9, b, 1})},
                                           stated);
  };
  EXPECT_EQ(estimate(2.8, 1, 3), 3U);  // (1 + 2.8) / 2 = 1.9
  EXPECT_EQ(estimate(3.4, 1, 3), 4U);  // (1 + 3.4) / 2 = 2.2
  EXPECT_EQ(estimate(1, 2.2, 4), 4U);  // (1 + 2 * 2.2) / 3 = 1.8
  EXPECT_EQ(estimate(1, 2.8, 4), 3U);  // (1 + 2 * 2.8) / 3 = 2.2
}

TEST(EstimatePointsPerLatticeRow, AveragesOverAllImages) {
  const auto uneven = make_line({0, 0, 1, 1, 9, 3.4, 1, 1, 3.4, 9, 1, 1});
  const auto even = make_line({0, 0, 1, 1, 9, 1, 1, 1, 1, 9, 1, 1});
  EXPECT_EQ(estimate_points_per_lattice_row(Images{uneven}, 3), 4U);
  EXPECT_EQ(estimate_points_per_lattice_row(Images{uneven, even}, 3), 3U);
}

TEST(EstimatePointsPerLatticeRow, SkipsTriplesWithMissingPoint) {
  auto pixels = make_line({0, 0, 1, 1, 9, 50, 1, 1, 1, 9, 1, 1});
  EXPECT_EQ(estimate_points_per_lattice_row(Images{pixels}, 3), 4U);
  for (const std::size_t missing : {3U, 4U, 5U}) {
    auto part = pixels;
    part[missing].reset();
    EXPECT_EQ(estimate_points_per_lattice_row(Images{part}, 3), 3U) << missing;
  }
}

}  // namespace
}  // namespace vlp
