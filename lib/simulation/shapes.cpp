// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace vlp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the index of the closest line.
int get_closest_line(const std::vector<double>& lines, double at) {
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
  CellTraversal(const EdgeCoordinates& all, double from, double displacement)
      : lines(all.coordinates_m()),
        start(from),
        length(displacement),
        cell(all.count_lines_up_to(from)) {
    if (displacement < 0 && cell > 0 && lines[std::size_t(cell) - 1] == from) --cell;  // downwards
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

EdgeCoordinates::EdgeCoordinates(std::vector<double> lines_m) : lines_m_(std::move(lines_m)) {
  constexpr double same_m = 1e-9;
  constexpr std::size_t intervals_per_line = 4;
  std::sort(lines_m_.begin(), lines_m_.end());
  const auto same = [](double a, double b) { return b - a < same_m; };
  lines_m_.erase(std::unique(lines_m_.begin(), lines_m_.end(), same), lines_m_.end());
  if (lines_m_.size() < 2) return;
  lines_before_.assign(intervals_per_line * lines_m_.size(), 0);
  intervals_per_m_ =
      static_cast<double>(lines_before_.size()) / (lines_m_.back() - lines_m_.front());
  for (std::size_t i = 0; i < lines_before_.size(); ++i) {
    lines_before_[i] = static_cast<int>(std::ranges::count_if(
        lines_m_, [&](double line_m) { return look_up_interval(line_m) < i; }));
  }
}

std::size_t EdgeCoordinates::look_up_interval(double at_m) const {
  const double last = static_cast<double>(lines_before_.size()) - 1;
  return static_cast<std::size_t>(
      std::clamp((at_m - lines_m_.front()) * intervals_per_m_, 0.0, last));
}

int EdgeCoordinates::count_lines_up_to(double at_m) const {
  std::size_t cell =
      lines_before_.empty() ? 0 : static_cast<std::size_t>(lines_before_[look_up_interval(at_m)]);
  while (cell < lines_m_.size() && lines_m_[cell] <= at_m) ++cell;
  return static_cast<int>(cell);
}

RectanglePattern::RectanglePattern(const std::vector<Rectangle>& rectangles) {
  std::vector<double> x_m, y_m;
  for (const Rectangle& each : rectangles) {
    x_m.insert(x_m.end(), {each.left_m, each.right_m});
    y_m.insert(y_m.end(), {each.top_m, each.bottom_m});
  }
  x_ = EdgeCoordinates(std::move(x_m));
  y_ = EdgeCoordinates(std::move(y_m));
  stride_ = x_.coordinates_m().size() + 1;
  values_.assign(stride_ * (y_.coordinates_m().size() + 1), 0);
  for (const Rectangle& rectangle : rectangles) fill_rectangle(rectangle);
  fill_row_integrals();
}

void RectanglePattern::fill_rectangle(const Rectangle& rectangle) {
  const int top = get_closest_line(y_.coordinates_m(), rectangle.top_m),
            bottom = get_closest_line(y_.coordinates_m(), rectangle.bottom_m);
  const int left = get_closest_line(x_.coordinates_m(), rectangle.left_m),
            right = get_closest_line(x_.coordinates_m(), rectangle.right_m);
  for (int row = top + 1; row <= bottom; ++row) {
    for (int column = left + 1; column <= right; ++column) {
      values_[flat_cell_index(column, row)] = rectangle.value;
    }
  }
}

void RectanglePattern::fill_row_integrals() {
  const std::vector<double>& x_m = x_.coordinates_m();
  sums_.assign(values_.size(), 0);
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const std::size_t column = i % stride_;
    if (column < 2) continue;
    sums_[i] = sums_[i - 1] + values_[i - 1] * (x_m[column - 1] - x_m[column - 2]);
  }
}

/// Returns the integral of the pattern along a row up to x, which lies in the given column.
double RectanglePattern::integrate_row(int column, int row, double x) const {
  if (column == 0) return 0;
  const std::size_t i = flat_cell_index(column, row);
  return sums_[i] + values_[i] * (x - x_.coordinates_m()[static_cast<std::size_t>(column) - 1]);
}

double RectanglePattern::integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  const Eigen::Vector2d displacement = q - p;
  if (!displacement.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  CellTraversal x(x_, p.x(), displacement.x()), y(y_, p.y(), displacement.y());
  double sum = 0, done = 0;
  while (done < 1) {
    const double x_end = x.end(), y_end = y.end();
    const double next = std::min({x_end, y_end, 1.0});
    const double middle = p.x() + displacement.x() * (done + next) / 2;
    sum += integrate_row(x.cell, y.cell, middle) * (next - done);
    if (x_end <= y_end) {
      x.step();
    } else {
      y.step();
    }
    done = next;
  }
  return sum * displacement.y();
}

std::optional<double> RectanglePattern::find_uniform_value(
    const std::array<Eigen::Vector2d, 4>& corners) const {
  const auto points = to_matrix(corners);
  if (!points.allFinite()) return std::nullopt;
  const Eigen::Vector2d lower = points.rowwise().minCoeff(), upper = points.rowwise().maxCoeff();
  const int left = x_.count_lines_up_to(lower.x()), right = x_.count_lines_up_to(upper.x());
  const int top = y_.count_lines_up_to(lower.y()), bottom = y_.count_lines_up_to(upper.y());
  const double value = values_[flat_cell_index(left, top)];
  for (int row = top; row <= bottom; ++row) {
    const auto cell = values_.begin() + static_cast<std::ptrdiff_t>(flat_cell_index(left, row));
    if (std::any_of(cell, cell + (right - left + 1), [&](double v) { return v != value; }))
      return std::nullopt;
  }
  return value;
}

double Disc::integrate_triangle(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  return cross_product_2d(p, q) *
         (0.5 - fall_ / 12 * (p.squaredNorm() + p.dot(q) + q.squaredNorm()));
}

double Disc::integrate_sector(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  return std::atan2(cross_product_2d(p, q), p.dot(q)) * (0.5 - fall_ / 4);
}

std::optional<double> Disc::find_uniform_value(
    const std::array<Eigen::Vector2d, 4>& corners) const {
  const auto points = to_matrix(corners);
  const bool outside =
      points.rowwise().minCoeff().maxCoeff() > 1 || points.rowwise().maxCoeff().minCoeff() < -1;
  return outside ? std::optional(0.0) : std::nullopt;
}

double Disc::integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  if (p.squaredNorm() <= 1 && q.squaredNorm() <= 1) return integrate_triangle(p, q);
  // |p + t (q - p)| = 1
  const Eigen::Vector2d displacement = q - p;
  const double a = displacement.squaredNorm(), b = p.dot(displacement), c = p.squaredNorm() - 1;
  const double discriminant = b * b - a * c;
  if (!(discriminant > 0)) return integrate_sector(p, q);
  const double root = std::sqrt(discriminant);
  const double enters = std::max((-b - root) / a, 0.0), leaves = std::min((-b + root) / a, 1.0);
  if (!(enters < leaves)) return integrate_sector(p, q);
  const Eigen::Vector2d in = p + enters * displacement, out = p + leaves * displacement;
  double sum = integrate_triangle(in, out);
  if (enters > 0) sum += integrate_sector(p, in);
  if (leaves < 1) sum += integrate_sector(out, q);
  return sum;
}

}  // namespace vlp
