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

/// Ascending coordinates, along one axis, of the edges in a pattern, with a table for the search.
class EdgeCoordinates {
 public:
  EdgeCoordinates() = default;
  /// @param lines_m  coordinates in any order; those closer than 1 nm are merged
  explicit EdgeCoordinates(std::vector<double> lines_m);

  const std::vector<double>& coordinates_m() const { return lines_m_; }
  /// Returns the number of lines at or below a coordinate: 0 before the first.
  int count_lines_up_to(double at_m) const;

 private:
  /// Returns the index in the table of the equal interval that contains a coordinate; of the first
  /// or the last one outside them.
  std::size_t look_up_interval(double at_m) const;

  std::vector<double> lines_m_;
  double intervals_per_m_ = 0;
  /// Number of lines in the intervals before each one.
  std::vector<int> lines_before_;
};

/// Flat pattern of rectangles, each with a constant value; positions are in m. The value is 0
/// outside all rectangles.
class RectanglePattern {
 public:
  /// Creates the pattern; later rectangles cover earlier ones. Edges closer than 1 nm are merged.
  explicit RectanglePattern(const std::vector<Rectangle>& rectangles);

  Eigen::Vector2d intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return intersect_plane(origin, direction);
  }

  /// Returns the integral of G dy along the edge from p to q. G(x, y) is the integral of the
  /// pattern along the row from minus infinity to x.
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

  /// Returns the value of the pattern over a quadrilateral; std::nullopt if the pattern varies
  /// within the box around the corners, or if a corner is not finite.
  std::optional<double> find_uniform_value(const std::array<Eigen::Vector2d, 4>& corners) const;

 private:
  void fill_rectangle(const Rectangle& rectangle);
  void fill_row_integrals();
  std::size_t flat_cell_index(int column, int row) const {
    return static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column);
  }
  double integrate_row(int column, int row, double x) const;

  EdgeCoordinates x_, y_;
  /// Row by row. Each row begins with the empty cell to its left and ends with the one to its
  /// right.
  std::vector<double> values_, sums_;
  std::size_t stride_;
};

/// Disc around the origin with the radiance 1 - (1 - rim_to_center_ratio) (r / radius)^2. An
/// ellipse with axes along x and y is a disc in units of its half axes.
class Disc {
 public:
  Disc(const Eigen::Vector2d& half_axes_m, double rim_to_center_ratio)
      : half_axes_m_(half_axes_m), fall_(1 - rim_to_center_ratio) {}

  Eigen::Vector2d intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return intersect_plane(origin, direction).cwiseQuotient(half_axes_m_);
  }

  /// Returns 0 for a quadrilateral on the outer side of one side of the square around the disc.
  std::optional<double> find_uniform_value(const std::array<Eigen::Vector2d, 4>& corners) const;

  /// Returns the integral over the part of the triangle (0, p, q) inside the disc, in units of the
  /// radius. add_shape_to_image() needs no other triangles.
  ///   Triangle inside: the area (p x q) / 2; of r^2, (p x q) (p p + p q + q q) / 12.
  ///   Sector of angle a: the area a / 2; of r^2, a / 4.
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

 private:
  double integrate_triangle(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;
  double integrate_sector(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

  Eigen::Vector2d half_axes_m_;
  double fall_;
};

}  // namespace vlp
