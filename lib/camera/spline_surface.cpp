// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/spline_surface.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/angles.h"

namespace vlp {
namespace {

/// Returns the weights of the control points of a piece, one row per control point: coefficients of
/// a polynomial of t, the constant first. t is in [0, 1] for cubic pieces and [-1/2, 1/2] for
/// quadratic ones.
template <int Order>
Eigen::Matrix<double, Order + 1, Order + 1> compute_spline_basis();

template <>
Eigen::Matrix3d compute_spline_basis<2>() {
  Eigen::Matrix3d rows;
  rows << 1, -4, 4, 6, 0, -8, 1, 4, 4;
  return rows / 8;
}

template <>
Eigen::Matrix4d compute_spline_basis<3>() {
  Eigen::Matrix4d rows;
  rows << 1, -3, 3, -1, 4, 0, -6, 3, 1, 3, 3, -3, 0, 0, 0, 1;
  return rows / 6;
}

/// Piece along one axis and the position t in it.
struct Piece {
  int index;
  double t;
};

/// Returns the piece at a position, which counts in control points from the first one.
template <int Order>
Piece locate_spline_piece(double at, int control_points) {
  constexpr double middle = Order == 2 ? 0.5 : 0;
  const int interval = std::clamp(static_cast<int>(at + middle), 1, control_points - Order);
  return {interval - 1, at - interval};
}

}  // namespace

SplineSurface::SplineSurface(const SplineGrid& grid, std::span<const double> control_points)
    : grid_(grid) {
  const double edge = 2 * std::tan(rad_from_deg(grid.fov_x_deg) / 4);
  pieces_per_u_ = (grid.nx - grid.order) / (2 * edge);
  reach_ = {edge, (grid.ny - grid.order) / (2 * pieces_per_u_)};
  if (grid.order == 2) {
    compute_spline_pieces<2>(control_points);
  } else {
    compute_spline_pieces<3>(control_points);
  }
  compute_initial_guesses();
}

template <int Order>
void SplineSurface::compute_spline_pieces(std::span<const double> control_points) {
  constexpr int width = Order + 1;
  const Eigen::Matrix<double, width, width> by_power = compute_spline_basis<Order>().transpose();
  Eigen::Matrix<double, width, width> x, y;
  for (int row = 0; row < grid_.ny - Order; ++row) {
    for (int column = 0; column < grid_.nx - Order; ++column) {
      for (int j = 0; j < width; ++j) {
        for (int i = 0; i < width; ++i) {
          const auto point = static_cast<std::size_t>((row + j) * grid_.nx + column + i);
          x(j, i) = control_points[2 * point];
          y(j, i) = control_points[2 * point + 1];
        }
      }
      const Eigen::Matrix<double, width, width> of_x = by_power * x * by_power.transpose(),
                                                of_y = by_power * y * by_power.transpose();
      for (int j = 0; j < width; ++j) {
        for (int i = 0; i < width; ++i) pieces_.emplace_back(of_x(j, i), of_y(j, i));
      }
    }
  }
}

template <int Order>
SplineSurface::Value SplineSurface::evaluate_spline(const Eigen::Vector2d& u) const {
  constexpr int width = Order + 1;
  const auto [column, x] =
      locate_spline_piece<Order>(u.x() * pieces_per_u_ + (grid_.nx - 1) / 2.0, grid_.nx);
  const auto [row, y] =
      locate_spline_piece<Order>(u.y() * pieces_per_u_ + (grid_.ny - 1) / 2.0, grid_.ny);
  const Eigen::Vector2d* powers = pieces_.data() + static_cast<std::ptrdiff_t>(width * width) *
                                                       (row * (grid_.nx - Order) + column);
  Eigen::Vector2d shift(0, 0), by_x(0, 0), by_y(0, 0);
  for (int j = Order; j >= 0; --j) {  // Horner's scheme, in x within y
    const Eigen::Vector2d* line = powers + std::ptrdiff_t{j} * width;
    Eigen::Vector2d at = line[Order], slope = at;
    for (int i = Order - 1; i > 0; --i) {
      at = at * x + line[i];
      slope = slope * x + at;
    }
    at = at * x + line[0];
    by_y = by_y * y + shift;
    shift = shift * y + at;
    by_x = by_x * y + slope;
  }
  Value value{u + shift, Eigen::Matrix2d::Identity()};
  value.d_distorted_d_u.col(0) += pieces_per_u_ * by_x;
  value.d_distorted_d_u.col(1) += pieces_per_u_ * by_y;
  return value;
}

SplineSurface::Value SplineSurface::operator()(const Eigen::Vector2d& u) const {
  return grid_.order == 2 ? evaluate_spline<2>(u) : evaluate_spline<3>(u);
}

template <int Order>
SplineSurface::Weights SplineSurface::compute_weights(const Eigen::Vector2d& u) const {
  const Piece x = locate_spline_piece<Order>(u.x() * pieces_per_u_ + (grid_.nx - 1) / 2.0,
                                             grid_.nx),
              y = locate_spline_piece<Order>(u.y() * pieces_per_u_ + (grid_.ny - 1) / 2.0,
                                             grid_.ny);
  Weights weights{x.index, y.index, {}, {}};
  const auto rows = compute_spline_basis<Order>();
  double power_x = 1, power_y = 1;
  for (int power = 0; power <= Order; ++power, power_x *= x.t, power_y *= y.t) {
    for (int i = 0; i <= Order; ++i) {
      weights.x[static_cast<std::size_t>(i)] += rows(i, power) * power_x;
      weights.y[static_cast<std::size_t>(i)] += rows(i, power) * power_y;
    }
  }
  return weights;
}

SplineSurface::Weights SplineSurface::look_up_weights(const Eigen::Vector2d& u) const {
  return grid_.order == 2 ? compute_weights<2>(u) : compute_weights<3>(u);
}

template <int Order>
std::optional<Eigen::Vector2d> SplineSurface::search_undistorted_point(
    Eigen::Vector2d u, const Eigen::Vector2d& distorted, Eigen::Matrix2d& d_distorted_d_u) const {
  constexpr int max_iterations = 50, max_halvings = 12;
  constexpr double numeric_tolerance = 1e-12;  // relative to the reach, for pixels at its very end
  Eigen::Vector2d from = u, step(0, 0);
  double smallest = std::numeric_limits<double>::infinity();
  for (int iterations = 0, halvings = 0; iterations < max_iterations;) {
    // The only call, so that the compiler inlines it into the loop.
    const Value at = evaluate_spline<Order>(u);
    const Eigen::Vector2d error = at.distorted - distorted;
    if (!(error.squaredNorm() < smallest)) {  // halve the step until the error decreases
      if (++halvings == max_halvings) return std::nullopt;
      step /= 2;
      u = clamp_to_extent(from + step);
      continue;
    }
    const Eigen::Matrix2d& j = at.d_distorted_d_u;
    const double determinant = j.determinant();
    if (!(determinant > 0)) return std::nullopt;
    step = Eigen::Vector2d(j(0, 1) * error.y() - j(1, 1) * error.x(),
                           j(1, 0) * error.x() - j(0, 0) * error.y()) /
           determinant;
    // Newton's method converges quadratically: after a step of 1e-6 the error is 1e-12.
    if (step.squaredNorm() <= 1e-12) {
      u += step;
      if (!((u.cwiseAbs() - reach_).maxCoeff() <= numeric_tolerance * reach_.maxCoeff())) {
        return std::nullopt;
      }
      d_distorted_d_u = j;
      return clamp_to_extent(u);
    }
    from = u, smallest = error.squaredNorm(), halvings = 0, ++iterations;
    u = clamp_to_extent(from + step);
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> SplineSurface::undistort_point(
    const Eigen::Vector2d& distorted, Eigen::Matrix2d& d_distorted_d_u) const {
  const Eigen::Vector2d start = guess_undistorted_point(distorted);
  return grid_.order == 2 ? search_undistorted_point<2>(start, distorted, d_distorted_d_u)
                          : search_undistorted_point<3>(start, distorted, d_distorted_d_u);
}

Eigen::Vector2d SplineSurface::guess_undistorted_point(const Eigen::Vector2d& distorted) const {
  const Eigen::Vector2d at = (distorted - first_node_).cwiseProduct(nodes_per_unit_);
  const auto clamp_node = [](double node) { return node > 0 ? std::min(node, kNodes - 1.0) : 0; };
  const double column = clamp_node(at.x()), row = clamp_node(at.y());
  const int i = std::min(static_cast<int>(column), kNodes - 2);
  const int j = std::min(static_cast<int>(row), kNodes - 2);
  const double x = column - i, y = row - j;
  const Eigen::Vector2d* node =
      initial_points_.data() + static_cast<std::ptrdiff_t>(j) * kNodes + i;
  return clamp_to_extent((1 - y) * ((1 - x) * node[0] + x * node[1]) +
                         y * ((1 - x) * node[kNodes] + x * node[kNodes + 1]));
}

void SplineSurface::compute_initial_guesses() {
  constexpr int num_samples = 2 * kNodes - 1;
  constexpr double inf = std::numeric_limits<double>::infinity();
  std::vector<std::pair<Eigen::Vector2d, Value>> places;
  places.reserve(static_cast<std::size_t>(num_samples) * num_samples);
  Eigen::Vector2d smallest(inf, inf), largest(-inf, -inf);
  for (int row = 0; row < num_samples; ++row) {
    for (int column = 0; column < num_samples; ++column) {
      const Eigen::Vector2d fraction = Eigen::Vector2d(column, row) / (kNodes - 1);
      const Eigen::Vector2d u = reach_.cwiseProduct(fraction - Eigen::Vector2d(1, 1));
      places.emplace_back(u, (*this)(u));
      smallest = smallest.cwiseMin(places.back().second.distorted);
      largest = largest.cwiseMax(places.back().second.distorted);
    }
  }
  first_node_ = smallest;
  constexpr double tiny = 1e-300;  // if all distorted positions coincide
  nodes_per_unit_ = (kNodes - 1) * (largest - smallest).cwiseMax(tiny).cwiseInverse();
  initial_points_.assign(static_cast<std::size_t>(kNodes) * kNodes, Eigen::Vector2d::Zero());
  // The initial point of a node is extrapolated from the sample nearest to the node.
  std::vector<double> distances(initial_points_.size(), inf);
  for (const auto& [u, at] : places) {
    const Eigen::Vector2d node = (at.distorted - smallest).cwiseProduct(nodes_per_unit_);
    const Eigen::Vector2d whole = node.array().round();
    const Eigen::Vector2d start =
        u + at.d_distorted_d_u.inverse() * (whole - node).cwiseQuotient(nodes_per_unit_);
    if (!(at.d_distorted_d_u.determinant() > 0) || !start.allFinite()) continue;
    const auto index = static_cast<std::size_t>(whole.y() * kNodes + whole.x());
    const double distance = (node - whole).squaredNorm();
    if (!(distance < distances[index])) continue;
    distances[index] = distance;
    initial_points_[index] = clamp_to_extent(start);
  }
  // Nodes without a sample take the initial point of a neighbor: right and down, then left and up.
  const auto copy_from = [&](std::size_t to, std::size_t from) {
    if (distances[to] < inf || distances[from] == inf) return;
    distances[to] = distances[from];
    initial_points_[to] = initial_points_[from];
  };
  for (std::size_t i = 1; i < initial_points_.size(); ++i) {
    if (i % kNodes > 0) copy_from(i, i - 1);
    if (i >= kNodes) copy_from(i, i - kNodes);
  }
  for (std::size_t i = initial_points_.size() - 1; i-- > 0;) {
    if ((i + 1) % kNodes > 0) copy_from(i, i + 1);
    if (i + kNodes < initial_points_.size()) copy_from(i, i + kNodes);
  }
}

}  // namespace vlp
