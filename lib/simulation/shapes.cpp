// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vlp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the coordinates in ascending order, with those that differ by rounding only merged.
std::vector<double> merge_lines(std::vector<double> lines) {
  constexpr double same_m = 1e-9;
  std::sort(lines.begin(), lines.end());
  const auto same = [](double a, double b) { return b - a < same_m; };
  lines.erase(std::unique(lines.begin(), lines.end(), same), lines.end());
  return lines;
}

/// Returns the number of lines at or below a coordinate: 0 before the first.
int find_cell_of_coordinate(const std::vector<double>& lines, double at) {
  return static_cast<int>(std::upper_bound(lines.begin(), lines.end(), at) - lines.begin());
}

/// Returns the index of the closest line.
int find_closest_line(const std::vector<double>& lines, double at) {
  const auto closer = [&](double a, double b) { return std::abs(a - at) < std::abs(b - at); };
  return static_cast<int>(std::min_element(lines.begin(), lines.end(), closer) - lines.begin());
}

/// Returns the corners of a quadrilateral as columns.
Eigen::Matrix<double, 2, 4> to_matrix(const std::array<Eigen::Vector2d, 4>& corners) {
  return Eigen::Matrix<double, 2, 4>::Map(corners[0].data());
}

/// Traversal of the cells along one axis: the current cell, and the fraction of the path at which
/// it ends.
struct CellTraversal {
  CellTraversal(const std::vector<double>& all, double from, double displacement)
      : lines(all), start(from), length(displacement), cell(find_cell_of_coordinate(all, from)) {
    if (displacement < 0 && cell > 0 && all[std::size_t(cell) - 1] == from) --cell;  // downwards
  }
  double end() const {
    const int line = length > 0 ? cell : cell - 1;
    if (length == 0 || line < 0 || line >= static_cast<int>(lines.size())) return kInfinity;
    return (lines[static_cast<std::size_t>(line)] - start) / length;
  }
  void step() { cell += length > 0 ? 1 : -1; }

  const std::vector<double>& lines;
  double start, length;
  int cell;
};

}  // namespace

RectanglePattern::RectanglePattern(const std::vector<Rectangle>& rectangles) {
  for (const Rectangle& each : rectangles) {
    x_m_.insert(x_m_.end(), {each.left_m, each.right_m});
    y_m_.insert(y_m_.end(), {each.top_m, each.bottom_m});
  }
  x_m_ = merge_lines(std::move(x_m_));
  y_m_ = merge_lines(std::move(y_m_));
  stride_ = x_m_.size() + 1;
  values_.assign(stride_ * (y_m_.size() + 1), 0);
  for (const Rectangle& rectangle : rectangles) fill_pattern_rectangle(rectangle);
  compute_cumulative_row_integrals();
}

void RectanglePattern::fill_pattern_rectangle(const Rectangle& rectangle) {
  const int top = find_closest_line(y_m_, rectangle.top_m),
            bottom = find_closest_line(y_m_, rectangle.bottom_m);
  const int left = find_closest_line(x_m_, rectangle.left_m),
            right = find_closest_line(x_m_, rectangle.right_m);
  for (int row = top + 1; row <= bottom; ++row) {
    for (int column = left + 1; column <= right; ++column) {
      values_[flat_cell_index(column, row)] = rectangle.value;
    }
  }
}

void RectanglePattern::compute_cumulative_row_integrals() {
  sums_.assign(values_.size(), 0);
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const std::size_t column = i % stride_;
    if (column < 2) continue;
    sums_[i] = sums_[i - 1] + values_[i - 1] * (x_m_[column - 1] - x_m_[column - 2]);
  }
}

/// Returns the integral of the pattern along a row up to x, which lies in the given column.
double RectanglePattern::integrate_pattern_row_up_to(int column, int row, double x) const {
  if (column == 0) return 0;
  const std::size_t i = flat_cell_index(column, row);
  return sums_[i] + values_[i] * (x - x_m_[static_cast<std::size_t>(column) - 1]);
}

double RectanglePattern::compute_edge_contribution_to_area_integral(
    const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  const Eigen::Vector2d displacement = q - p;
  if (!displacement.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  CellTraversal x(x_m_, p.x(), displacement.x()), y(y_m_, p.y(), displacement.y());
  double sum = 0, done = 0;
  while (done < 1) {
    const double x_end = x.end(), y_end = y.end();
    const double next = std::min({x_end, y_end, 1.0});
    const double middle = p.x() + displacement.x() * (done + next) / 2;
    sum += integrate_pattern_row_up_to(x.cell, y.cell, middle) * (next - done);
    if (x_end <= y_end) {
      x.step();
    } else {
      y.step();
    }
    done = next;
  }
  return sum * displacement.y();
}

std::optional<double> RectanglePattern::find_constant_value_in_quadrilateral(
    const std::array<Eigen::Vector2d, 4>& corners) const {
  const auto points = to_matrix(corners);
  if (!points.allFinite()) return std::nullopt;
  const Eigen::Vector2d lower = points.rowwise().minCoeff(), upper = points.rowwise().maxCoeff();
  const int column = find_cell_of_coordinate(x_m_, lower.x()),
            row = find_cell_of_coordinate(y_m_, lower.y());
  const auto ends_before = [](const std::vector<double>& lines, int cell, double at) {
    return cell < static_cast<int>(lines.size()) && lines[static_cast<std::size_t>(cell)] <= at;
  };
  if (ends_before(x_m_, column, upper.x()) || ends_before(y_m_, row, upper.y()))
    return std::nullopt;
  return values_[flat_cell_index(column, row)];
}

double Disc::integrate_disc_radiance_in_triangle(const Eigen::Vector2d& p,
                                                 const Eigen::Vector2d& q) const {
  return cross_product_2d(p, q) *
         (0.5 - fall_ / 12 * (p.squaredNorm() + p.dot(q) + q.squaredNorm()));
}

double Disc::integrate_disc_radiance_in_sector(const Eigen::Vector2d& p,
                                               const Eigen::Vector2d& q) const {
  return std::atan2(cross_product_2d(p, q), p.dot(q)) * (0.5 - fall_ / 4);
}

std::optional<double> Disc::find_constant_value_in_quadrilateral(
    const std::array<Eigen::Vector2d, 4>& corners) const {
  const auto points = to_matrix(corners);
  const bool outside =
      points.rowwise().minCoeff().maxCoeff() > 1 || points.rowwise().maxCoeff().minCoeff() < -1;
  return outside ? std::optional(0.0) : std::nullopt;
}

double Disc::compute_edge_contribution_to_area_integral(const Eigen::Vector2d& p,
                                                        const Eigen::Vector2d& q) const {
  if (p.squaredNorm() <= 1 && q.squaredNorm() <= 1)
    return integrate_disc_radiance_in_triangle(p, q);
  // |p + t (q - p)| = 1
  const Eigen::Vector2d displacement = q - p;
  const double a = displacement.squaredNorm(), b = p.dot(displacement), c = p.squaredNorm() - 1;
  const double discriminant = b * b - a * c;
  if (!(discriminant > 0)) return integrate_disc_radiance_in_sector(p, q);
  const double root = std::sqrt(discriminant);
  const double enters = std::max((-b - root) / a, 0.0), leaves = std::min((-b + root) / a, 1.0);
  if (!(enters < leaves)) return integrate_disc_radiance_in_sector(p, q);
  const Eigen::Vector2d in = p + enters * displacement, out = p + leaves * displacement;
  double sum = integrate_disc_radiance_in_triangle(in, out);
  if (enters > 0) sum += integrate_disc_radiance_in_sector(p, in);
  if (leaves < 1) sum += integrate_disc_radiance_in_sector(out, q);
  return sum;
}

}  // namespace vlp
