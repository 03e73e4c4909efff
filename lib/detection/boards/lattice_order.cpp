// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/lattice_order.h"

#include <algorithm>
#include <array>
#include <limits>

namespace vlp {
namespace {

struct Node {
  int col, row;
};

/// Returns the mean displacement in the image to the next point along a row and along a column.
std::array<Eigen::Vector2d, 2> compute_axis_directions(const std::vector<PointDetection>& points,
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
void renumber_points(std::vector<PointDetection>& points, int cols, const Change& change) {
  for (PointDetection& point : points) {
    const int index = static_cast<int>(point.index);
    const Node to = change(Node{index % cols, index / cols});
    point.index = static_cast<std::size_t>(to.row * cols + to.col);
  }
  std::sort(points.begin(), points.end(),
            [](const PointDetection& a, const PointDetection& b) { return a.index < b.index; });
}

/// Returns the mean length of the second differences along rows of `row` points, in px; NaN if
/// there are none.
double compute_unevenness_px(std::span<const LatticePixels> images, std::size_t row) {
  double sum_px = 0, count = 0;
  for (const LatticePixels& points : images) {
    for (std::size_t i = 2; i < points.size(); ++i) {
      if (i % row < 2 || !points[i] || !points[i - 1] || !points[i - 2]) continue;
      sum_px += (*points[i] - 2 * *points[i - 1] + *points[i - 2]).norm();
      count += 1;
    }
  }
  return count > 0 ? sum_px / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void renumber_lattice(std::vector<PointDetection>& points, int cols, int rows,
                      bool has_180_degree_symmetry) {
  const auto width = static_cast<std::size_t>(cols);
  const auto [right, down] = compute_axis_directions(points, width);
  if (right.x() * down.y() - right.y() * down.x() < 0) {
    renumber_points(points, cols, [&](Node node) { return Node{node.col, rows - 1 - node.row}; });
  }
  if (!has_180_degree_symmetry) return;
  if (cols == rows) {
    const auto [x, y] = compute_axis_directions(points, width);
    if (std::abs(y.x()) > std::abs(x.x())) {
      renumber_points(points, cols, [&](Node node) { return Node{node.row, rows - 1 - node.col}; });
    }
  }
  if (compute_axis_directions(points, width)[0].x() < 0) {
    renumber_points(points, cols, [&](Node node) {
      return Node{cols - 1 - node.col, rows - 1 - node.row};
    });
  }
}

std::size_t estimate_points_per_row(std::span<const LatticePixels> images, std::size_t stated) {
  constexpr double max_ratio = 0.5;
  if (images.empty()) return stated;
  const std::size_t points = images.front().size();
  std::size_t best = stated;
  double min_px = std::numeric_limits<double>::infinity();
  // Longer rows are tried first, because a part of a row is as even as the row.
  for (std::size_t row = points / 3; row >= 3; --row) {
    if (points % row != 0) continue;
    const double px = compute_unevenness_px(images, row);
    if (!(px < max_ratio * min_px)) continue;
    min_px = px;
    best = row;
  }
  return min_px < max_ratio * compute_unevenness_px(images, stated) ? best : stated;
}

}  // namespace vlp
