// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "simulation/coverage.h"

namespace vlp {

/// Axis-aligned rectangle of constant value.
struct Rectangle {
  double left_m, top_m, right_m, bottom_m;
  double value;
};

/// Flat pattern of rectangles, zero around them.
class Mosaic {
 public:
  /// Later rectangles cover earlier ones. Edges closer than 1 nm are merged.
  explicit Mosaic(const std::vector<Rectangle>& rectangles);

  Eigen::Vector2d hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return plane_hit(origin, direction);
  }

  /// Returns the box around all rectangles; empty without rectangles.
  Eigen::AlignedBox2d bounds() const {
    if (x_m_.empty() || y_m_.empty()) return {};
    return {Eigen::Vector2d(x_m_.front(), y_m_.front()), Eigen::Vector2d(x_m_.back(), y_m_.back())};
  }

  /// Returns the integral of G dy along the edge from p to q. G(x, y) is the integral of the
  /// pattern along the row from minus infinity to x.
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

  /// Returns the value of the pattern over a quadrilateral; std::nullopt if a line of the pattern
  /// lies between its corners.
  std::optional<double> constant_value(const std::array<Eigen::Vector2d, 4>& corners) const;

 private:
  void fill(const Rectangle& rectangle);
  void accumulate_rows();
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column);
  }
  double value_sum(int column, int row, double x) const;

  std::vector<double> x_m_, y_m_;
  /// Row by row. Each row begins with the empty cell to its left and ends with the one to its
  /// right.
  std::vector<double> values_, sums_;
  std::size_t stride_;
};

}  // namespace vlp
