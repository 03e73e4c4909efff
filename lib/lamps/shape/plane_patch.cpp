// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/plane_patch.h"

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace vlp {
namespace {

constexpr int kNodesPerSide = 8, kNodes = kNodesPerSide * kNodesPerSide;

using Nodes = std::array<Eigen::Vector2d, kNodes>;

/// Returns the Chebyshev nodes in the square from -1 to 1.
Nodes compute_nodes() {
  Nodes nodes;
  const auto node = [](int k) { return std::cos(std::numbers::pi * (k + 0.5) / kNodesPerSide); };
  for (int i = 0; i < kNodes; ++i)
    nodes[std::size_t(i)] = {node(i % kNodesPerSide), node(i / kNodesPerSide)};
  return nodes;
}

/// Returns the matrix that computes the coefficients from the values at the nodes.
template <int Degree, int Terms>
Eigen::Matrix<double, Terms, kNodes> make_solver(const Nodes& nodes) {
  Eigen::Matrix<double, kNodes, Terms> values;
  for (int node = 0; node < kNodes; ++node) {
    const Eigen::Vector2d& at = nodes[std::size_t(node)];
    int term = 0;
    for (int i = 0; i <= Degree; ++i) {
      for (int j = 0; i + j <= Degree; ++j, ++term)
        values(node, term) = std::pow(at.x(), i) * std::pow(at.y(), j);
    }
  }
  return values.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace

std::optional<PlanePatch> PlanePatch::fit(const LightShape& shape, const PixelBox& box) {
  static const Nodes nodes = compute_nodes();
  static const auto solver = make_solver<kMaxDegree, kTerms>(nodes);
  PlanePatch patch;
  patch.middle_ = {box.x + (box.width - 1) / 2.0, box.y + (box.height - 1) / 2.0};
  patch.half_ = Eigen::Vector2d(box.width, box.height) / 2;
  Eigen::Matrix<double, kNodes, 2> values;
  for (int i = 0; i < kNodes; ++i) {
    const Eigen::Vector2d pixel = patch.middle_ + patch.half_.cwiseProduct(nodes[std::size_t(i)]);
    const auto at = shape.plane_from_pixel(shape.swap_axes(pixel));
    if (!at) return std::nullopt;
    values.row(i) = *at;
  }
  patch.coefficients_ = solver * values;
  patch.degree_ = patch.select_polynomial_degree();
  return patch;
}

int PlanePatch::select_polynomial_degree() const {
  constexpr double max_error_px = 1e-4;
  // Sums of the terms of each degree: the largest error without them.
  std::array<double, kMaxDegree + 1> sums{};
  int term = 0;
  for (int i = 0; i <= kMaxDegree; ++i) {
    for (int j = 0; i + j <= kMaxDegree; ++j, ++term)
      sums[std::size_t(i + j)] += coefficients_.row(term).norm();
  }
  const double plane_per_px = sums[1] / half_.sum();
  double error = 0;
  int degree = kMaxDegree;
  while (degree > 1 && error + sums[std::size_t(degree)] < max_error_px * plane_per_px) {
    error += sums[std::size_t(degree)];
    --degree;
  }
  return degree;
}

PlanePatch::Row::Row(const PlanePatch& patch, double line)
    : middle_(patch.middle_.x()), half_(patch.half_.x()), degree_(std::size_t(patch.degree_)) {
  const double y = (line - patch.middle_.y()) / patch.half_.y();
  int first_term = 0;
  for (std::size_t i = 0; i <= degree_; ++i) {
    at_[i] = d_line_[i] = Eigen::Vector2d::Zero();
    double power = 1, lower_power = 0;
    for (std::size_t j = 0; i + j <= degree_; ++j) {
      const Eigen::Vector2d coefficient = patch.coefficients_.row(first_term + int(j));
      at_[i] += power * coefficient;
      d_line_[i] += double(j) * lower_power / patch.half_.y() * coefficient;
      lower_power = power;
      power *= y;
    }
    first_term += kMaxDegree + 1 - int(i);
  }
}

PlanePatch::Point PlanePatch::Row::at_column(double column) const {
  const double x = (column - middle_) / half_;
  Eigen::Vector2d at = at_[degree_], d_x = Eigen::Vector2d::Zero(), d_line = d_line_[degree_];
  for (std::size_t i = degree_; i-- > 0;) {
    d_x = d_x * x + at;
    at = at * x + at_[i];
    d_line = d_line * x + d_line_[i];
  }
  Point point{at, {}};
  point.d_at_d_pixel << d_x / half_, d_line;
  return point;
}

}  // namespace vlp
