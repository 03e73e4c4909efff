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

/// Distortion of mrcal's splined lenses in the stereographic plane u = 2 (x, y) / (|p| + z):
///   distorted = u + sum over i, j of B(s ux + (Nx - 1) / 2 - i) B(s uy + (Ny - 1) / 2 - j) c_ij
///   B     uniform B-spline of the grid's order
///   c_ij  control points
///   s     control points per unit of u; the outermost pieces end at the field of view:
///         s = (Nx - order) / (4 tan(fov_x / 4))
/// Const and safe to share between threads.
/// Source: mrcal documentation, "Splined stereographic lens model"; de Boor, "A Practical Guide to
/// Splines", 1978.
class SplineSurface {
 public:
  /// Creates the surface from its control points, row by row, each as x, y. Values are
  /// displacements in the stereographic plane, in focal lengths.
  /// @pre `control_points` has two numbers for each control point of the grid.
  SplineSurface(const SplineGrid& grid, std::span<const double> control_points);

  const SplineGrid& spline_grid() const { return grid_; }

  /// Half extent of the surface along x and y of the stereographic plane, in focal lengths. Beyond
  /// it the lens is not defined.
  const Eigen::Vector2d& spline_half_extent() const { return reach_; }
  /// Returns true if the surface is defined at `u`.
  bool is_defined_at(const Eigen::Vector2d& u) const {
    return std::abs(u.x()) <= reach_.x() && std::abs(u.y()) <= reach_.y();
  }

  struct Value {
    Eigen::Vector2d distorted;
    Eigen::Matrix2d d_distorted_d_u;
  };
  /// Computes the distorted point of u, in the stereographic plane, and its derivative with respect
  /// to u.
  /// @pre is_defined_at(u), also for distort_point() and look_up_weights()
  Value operator()(const Eigen::Vector2d& u) const;
  Eigen::Vector2d distort_point(const Eigen::Vector2d& u) const { return (*this)(u).distorted; }

  /// Weights of the control points at a point u: x[i] y[j] for the control point in column
  /// `column + i` and row `row + j`, with i and j from 0 to the order.
  struct Weights {
    int column, row;
    std::array<double, 4> x, y;
  };
  Weights look_up_weights(const Eigen::Vector2d& u) const;

  /// Computes the point u with this distorted position by Newton's method, from an initial point in
  /// a table of fixed size. Returns std::nullopt if no such point within spline_half_extent() is
  /// found. The derivative is evaluated before the last step, at most 1e-6 from u.
  std::optional<Eigen::Vector2d> undistort_point(const Eigen::Vector2d& distorted,
                                                 Eigen::Matrix2d& d_distorted_d_u) const;

 private:
  template <int Order>
  void compute_spline_pieces(std::span<const double> control_points);
  template <int Order>
  Weights compute_weights(const Eigen::Vector2d& u) const;
  template <int Order>
  inline Value evaluate_spline(const Eigen::Vector2d& u) const;
  template <int Order>
  std::optional<Eigen::Vector2d> search_undistorted_point(Eigen::Vector2d u,
                                                          const Eigen::Vector2d& distorted,
                                                          Eigen::Matrix2d& d_distorted_d_u) const;
  Eigen::Vector2d clamp_to_extent(const Eigen::Vector2d& u) const {
    return u.cwiseMax(-reach_).cwiseMin(reach_);
  }
  void compute_initial_guesses();
  Eigen::Vector2d guess_undistorted_point(const Eigen::Vector2d& distorted) const;

  SplineGrid grid_;
  double pieces_per_u_;
  Eigen::Vector2d reach_;
  /// Coefficients of x^i y^j of each piece, pieces row by row; for each j all i.
  std::vector<Eigen::Vector2d> pieces_;
  /// Initial points of undistort_point(): points whose distorted positions are close to the nodes
  /// of a kNodes x kNodes lattice over the range of the distorted positions.
  static constexpr int kNodes = 33;
  Eigen::Vector2d first_node_, nodes_per_unit_;
  std::vector<Eigen::Vector2d> initial_points_;
};

}  // namespace vlp
