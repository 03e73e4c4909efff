// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/lattice_order.h"

#include <algorithm>
#include <array>

namespace vlp {
namespace {

struct Node {
  int col, row;
};

/// Returns the mean displacement in the image to the next point along a row and along a column.
std::array<Eigen::Vector2d, 2> axis_directions(const std::vector<PointDetection>& points,
                                               std::size_t cols) {
  std::array<Eigen::Vector2d, 2> sums{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  std::array<double, 2> counts{1e-9, 1e-9};
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t k = i + 1; k < points.size() && points[k].index <= points[i].index + cols;
         ++k) {
      const std::size_t step = points[k].index - points[i].index;
      const bool along_row = step == 1 && points[k].index % cols != 0;
      if (!along_row && step != cols) continue;
      const std::size_t axis = along_row ? 0 : 1;
      sums[axis] += points[k].pixel - points[i].pixel;
      counts[axis] += 1;
    }
  }
  return {sums[0] / counts[0], sums[1] / counts[1]};
}

template <typename Change>
void renumber(std::vector<PointDetection>& points, int cols, const Change& change) {
  for (PointDetection& point : points) {
    const int index = static_cast<int>(point.index);
    const Node to = change(Node{index % cols, index / cols});
    point.index = static_cast<std::size_t>(to.row * cols + to.col);
  }
  std::sort(points.begin(), points.end(),
            [](const PointDetection& a, const PointDetection& b) { return a.index < b.index; });
}

}  // namespace

void order_lattice(std::vector<PointDetection>& points, int cols, int rows,
                   bool has_180_degree_symmetry) {
  const auto width = static_cast<std::size_t>(cols);
  const auto [right, down] = axis_directions(points, width);
  if (right.x() * down.y() - right.y() * down.x() < 0) {
    renumber(points, cols, [&](Node node) { return Node{node.col, rows - 1 - node.row}; });
  }
  if (!has_180_degree_symmetry) return;
  if (cols == rows) {
    const auto [x, y] = axis_directions(points, width);
    if (std::abs(y.x()) > std::abs(x.x())) {
      renumber(points, cols, [&](Node node) { return Node{node.row, rows - 1 - node.col}; });
    }
  }
  if (axis_directions(points, width)[0].x() < 0) {
    renumber(points, cols, [&](Node node) {
      return Node{cols - 1 - node.col, rows - 1 - node.row};
    });
  }
}

}  // namespace vlp
