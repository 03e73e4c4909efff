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

TEST(RenumberLattice, CountsRowsDownwards) {
  for (const bool is_symmetric : {false, true}) {
    auto points = make_points(4, 3, [](Node node) { return 4 * node.row + node.col; });
    renumber_lattice(points, 4, 3, is_symmetric);
    expect_numbered_from_top_left(points, 4);
    points = make_points(4, 3, [](Node node) { return 4 * (2 - node.row) + node.col; });
    renumber_lattice(points, 4, 3, is_symmetric);
    expect_numbered_from_top_left(points, 4);
  }
}

TEST(RenumberLattice, RotatesOnlySymmetricLatticesBy180Degrees) {
  const auto make_rotated = [] {
    return make_points(5, 3, [](Node node) { return 14 - 5 * node.row - node.col; });
  };
  auto points = make_rotated();
  renumber_lattice(points, 5, 3, true);
  expect_numbered_from_top_left(points, 5);
  points = make_rotated();
  renumber_lattice(points, 5, 3, false);
  EXPECT_EQ(points[0].pixel, make_rotated()[0].pixel);
  EXPECT_EQ(points[14].pixel, make_rotated()[14].pixel);
}

TEST(RenumberLattice, RotatesSquareLatticesBy90Degrees) {
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
    renumber_lattice(points, 3, 3, true);
    expect_numbered_from_top_left(points, 3);
  }
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

TEST(EstimatePointsPerRow, ReturnsLengthOfRows) {
  for (const std::size_t cols : {3U, 4U, 6U, 8U}) {
    const std::vector images{make_lattice(cols, 24 / cols), make_lattice(cols, 24 / cols)};
    for (const std::size_t stated : {3U, 4U, 6U, 8U}) {
      const std::size_t expected = cols % stated == 0 ? stated : cols;  // parts of rows are even
      EXPECT_EQ(estimate_points_per_row(images, stated), expected) << cols << stated;
    }
  }
}

}  // namespace
}  // namespace vlp
