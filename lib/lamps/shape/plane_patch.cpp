// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/plane_patch.h"

#include <Eigen/QR>
#include <cmath>
#include <numbers>

namespace vlp {
namespace {

constexpr int kNodesPerSide = 8, kNodes = kNodesPerSide * kNodesPerSide;

/// Returns a Chebyshev node in the square from -1 to 1.
Eigen::Vector2d get_node(int i) {
  const auto node = [](int k) { return std::cos(std::numbers::pi * (k + 0.5) / kNodesPerSide); };
  return {node(i % kNodesPerSide), node(i / kNodesPerSide)};
}

/// Returns the matrix that computes the coefficients from the values at the nodes.
template <int Degree, int Terms>
Eigen::Matrix<double, Terms, kNodes> make_least_squares_solver() {
  Eigen::Matrix<double, kNodes, Terms> values;
  for (int node = 0; node < kNodes; ++node) {
    const Eigen::Vector2d at = get_node(node);
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
  static const auto solver = make_least_squares_solver<kDegree, kTerms>();
  PlanePatch patch;
  patch.middle_ = {box.x + (box.width - 1) / 2.0, box.y + (box.height - 1) / 2.0};
  patch.half_ = Eigen::Vector2d(box.width, box.height) / 2;
  Eigen::Matrix<double, kNodes, 2> values;
  for (int i = 0; i < kNodes; ++i) {
    const Eigen::Vector2d pixel = patch.middle_ + patch.half_.cwiseProduct(get_node(i));
    const auto at = shape.level_plane_point_from_pixel(shape.swap_image_and_scanline_axes(pixel));
    if (!at) return std::nullopt;
    values.row(i) = *at;
  }
  patch.coefficients_ = solver * values;
  return patch;
}

PlanePatch::Row::Row(const PlanePatch& patch, double line)
    : middle_(patch.middle_.x()), half_(patch.half_.x()) {
  const double y = (line - patch.middle_.y()) / patch.half_.y();
  at_.fill(Eigen::Vector2d::Zero());
  d_line_.fill(Eigen::Vector2d::Zero());
  int term = 0;
  for (std::size_t i = 0; i <= kDegree; ++i) {
    double power = 1, lower_power = 0;
    for (std::size_t j = 0; i + j <= kDegree; ++j, ++term) {
      const Eigen::Vector2d coefficient = patch.coefficients_.row(term);
      at_[i] += power * coefficient;
      d_line_[i] += double(j) * lower_power / patch.half_.y() * coefficient;
      lower_power = power;
      power *= y;
    }
  }
}

PlanePatch::Point PlanePatch::Row::at_column(double column) const {
  const double x = (column - middle_) / half_;
  Eigen::Vector2d at = at_[kDegree], d_x = Eigen::Vector2d::Zero(), d_line = d_line_[kDegree];
  for (std::size_t i = kDegree; i-- > 0;) {
    d_x = d_x * x + at;
    at = at * x + at_[i];
    d_line = d_line * x + d_line_[i];
  }
  Point point{at, {}};
  point.d_at_d_pixel << d_x / half_, d_line;
  return point;
}

}  // namespace vlp
