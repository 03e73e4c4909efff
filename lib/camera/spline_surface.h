// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "spline_grid.h"

namespace vlp {

/// What mrcal's splined lenses add to the stereographic plane u = 2 (x, y) / (|p| + z):
///   distorted = u + sum over i, j of B(s ux + (Nx - 1) / 2 - i) B(s uy + (Ny - 1) / 2 - j) c_ij
/// with the uniform B-spline B of the order, control points c_ij and s per unit of u, such that the
/// outermost pieces end at the field of view:
///   s = (Nx - order) / (4 tan(fov_x / 4)).
/// Source: mrcal documentation, "Splined stereographic lens model"; de Boor, "A Practical Guide to
/// Splines", 1978. Const and safe to share between threads.
class SplineSurface {
 public:
  /// control_points: x and y in turn, row by row. Precondition: two for each of the grid's.
  SplineSurface(const SplineGrid& grid, std::span<const double> control_points);

  const SplineGrid& grid() const { return grid_; }

  /// Up to where there are pieces, on all four sides; beyond it is no lens.
  const Eigen::Vector2d& reach() const { return reach_; }
  bool covers(const Eigen::Vector2d& u) const {
    return std::abs(u.x()) <= reach_.x() && std::abs(u.y()) <= reach_.y();
  }

  struct Value {
    Eigen::Vector2d distorted;
    Eigen::Matrix2d d_distorted_d_u;
  };
  /// Precondition, here and below: covers(u).
  Value operator()(const Eigen::Vector2d& u) const;
  Eigen::Vector2d distorted(const Eigen::Vector2d& u) const { return (*this)(u).distorted; }

  /// The control points that a place depends on, and how much: that in column `column + i` and row
  /// `row + j` counts x[i] y[j], with i and j up to the order.
  struct Weights {
    int column, row;
    std::array<double, 4> x, y;
  };
  Weights weights(const Eigen::Vector2d& u) const;

  /// u, by Newton's method from a start out of a table of fixed size; nothing when no place up to
  /// the reach is distorted so. The derivative is that up to 1e-6 before.
  std::optional<Eigen::Vector2d> undistorted(const Eigen::Vector2d& distorted,
                                             Eigen::Matrix2d& d_distorted_d_u) const;

 private:
  template <int Order>
  void fill_pieces(std::span<const double> control_points);
  template <int Order>
  Weights weights_of(const Eigen::Vector2d& u) const;
  template <int Order>
  inline Value value(const Eigen::Vector2d& u) const;
  template <int Order>
  std::optional<Eigen::Vector2d> search(Eigen::Vector2d u, const Eigen::Vector2d& distorted,
                                        Eigen::Matrix2d& d_distorted_d_u) const;
  Eigen::Vector2d within_reach(const Eigen::Vector2d& u) const {
    return u.cwiseMax(-reach_).cwiseMin(reach_);
  }
  void fill_starts();
  Eigen::Vector2d start_for(const Eigen::Vector2d& distorted) const;

  SplineGrid grid_;
  double pieces_per_u_;
  Eigen::Vector2d reach_;
  /// Of each piece, row by row, the coefficients of x^i y^j: i in turn for each j.
  std::vector<Eigen::Vector2d> pieces_;
  /// Places that are distorted to the nodes of a lattice over all that is reached, or nearly so.
  static constexpr int kStarts = 33;
  Eigen::Vector2d first_start_, starts_per_unit_;
  std::vector<Eigen::Vector2d> starts_;
};

}  // namespace vlp
