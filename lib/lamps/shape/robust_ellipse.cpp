// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/robust_ellipse.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include "geometry/symmetric.h"
#include "lamps/shape/m_estimate.h"

namespace vlp {
namespace {

constexpr int kMinCirclePoints = 5;

std::optional<Circle> make_circle_through(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                          const Eigen::Vector2d& c) {
  const Eigen::Vector2d p = b - a, q = c - a;
  const double twice = 2 * (p.x() * q.y() - p.y() * q.x());
  if (std::abs(twice) <= 1e-6 * p.norm() * q.norm()) return std::nullopt;
  const double p2 = p.squaredNorm(), q2 = q.squaredNorm();
  const Eigen::Vector2d center((q.y() * p2 - p.y() * q2) / twice,
                               (p.x() * q2 - q.x() * p2) / twice);
  return Circle{a + center, center.norm()};
}

/// Returns the circle through three of the points that has most points close to it and few outside.
/// Points inside may be the edge of an occluder; points outside are not possible for a light.
std::optional<Circle> find_best_supported_circle(std::span<const Eigen::Vector2d> points,
                                                 double tolerance) {
  constexpr int triples = 40;
  std::optional<Circle> best;
  double max_score = kMinCirclePoints - 1;
  const std::size_t n = points.size();
  const double largest = compute_bounding_box_diagonal(points);
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<std::size_t>(state >> 8) % n;
  };
  for (int i = 0; i < triples; ++i) {
    const std::size_t a = next(), b = next(), c = next();
    const auto circle = make_circle_through(points[a], points[b], points[c]);
    if (!circle || circle->radius > largest) continue;
    const auto squared = [&](double off) {
      return std::pow(std::max(0.0, circle->radius + off), 2);
    };
    const double low = squared(-tolerance), high = squared(tolerance);
    const double outer = squared(3 * tolerance);
    int close = 0, outside = 0;
    for (const Eigen::Vector2d& point : points) {
      const double square = (point - circle->center).squaredNorm();
      close += square > low && square < high;
      outside += square > outer;
    }
    const double score = close - outside / 2.0;
    if (score > max_score) max_score = score, best = circle;
    if (close == static_cast<int>(n)) break;  // none has more
  }
  return best;
}

/// Ellipse (x - center)^T conic (x - center) = 1.
struct Conic {
  Eigen::Vector2d center;
  Matrix2 conic;

  CurveDistance<5> distance(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d away = point - center, gradient = conic * away;
    const double s = std::sqrt(std::max(0.0, away.dot(gradient)));
    const double steepness = std::max(gradient.norm(), std::numeric_limits<double>::min());
    CurveDistance<5> result;
    result.error = (s - 1) * s / steepness;
    result.slope << -gradient / steepness, away.x() * away.x() / (2 * steepness),
        away.x() * away.y() / steepness, away.y() * away.y() / (2 * steepness);
    return result;
  }
};

}  // namespace

double compute_bounding_box_diagonal(std::span<const Eigen::Vector2d> points) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : points) box.extend(point);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

std::optional<RobustEllipse> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                               std::span<const double> weights, double tolerance) {
  if (points.size() < kMinCirclePoints) return std::nullopt;
  const auto begin = find_best_supported_circle(points, tolerance);
  if (!begin) return std::nullopt;
  Eigen::Vector2d center = begin->center;
  double radius = begin->radius;
  RobustEllipse fit{};
  for (int iteration = 0; iteration < 5; ++iteration) {
    auto better = compute_m_estimate_step<3>(weights, tolerance, [&](std::size_t i) {
      const Eigen::Vector2d away = points[i] - center;
      const double norm = std::max(away.norm(), std::numeric_limits<double>::min());
      return CurveDistance<3>{norm - radius, {-away.x() / norm, -away.y() / norm, -1}};
    });
    if (!better) return std::nullopt;
    center -= better->step.head<2>();
    radius -= better->step[2];
    fit.center_covariance = better->parameter_covariance().topLeftCorner<2, 2>();
    fit.inliers = std::move(better->inliers);
    fit.count = better->count;
    if (better->step.norm() < 1e-3 * tolerance) break;
  }
  if (!(radius > 0) || !center.allFinite()) return std::nullopt;
  fit.center = center;
  fit.rim_from_circle = radius * Matrix2::Identity();
  return fit;
}

std::optional<RobustEllipse> fit_robust_ellipse(std::span<const Eigen::Vector2d> points,
                                                std::span<const double> weights, double tolerance) {
  constexpr double max_oval = 1.0 / 8, max_axis_ratio = 3;
  constexpr int num_iterations = 10;
  const double oval = std::max(tolerance, max_oval * compute_bounding_box_diagonal(points) / 2);
  const auto circle = fit_robust_circle(points, weights, oval);
  if (!circle) return std::nullopt;
  // Computed in units of the circle, so that center and conic have similar scales.
  const double unit = circle->to_circle().radius;
  Conic ellipse{Eigen::Vector2d::Zero(), Matrix2::Identity()};
  RobustEllipse fit{};
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    // The tolerance decreases as the ellipse converges.
    const double narrowed = std::max(tolerance, oval * std::pow(0.6, iteration));
    auto better = compute_m_estimate_step<5>(weights, narrowed / unit, [&](std::size_t i) {
      return ellipse.distance((points[i] - circle->center) / unit);
    });
    if (!better) return std::nullopt;
    ellipse.center -= better->step.head<2>();
    ellipse.conic(0, 0) -= better->step[2];
    ellipse.conic(0, 1) -= better->step[3];
    ellipse.conic(1, 0) = ellipse.conic(0, 1);
    ellipse.conic(1, 1) -= better->step[4];
    fit.center_covariance = better->parameter_covariance().topLeftCorner<2, 2>() * (unit * unit);
    fit.inliers = std::move(better->inliers);
    fit.count = better->count;
  }
  const auto axes = eigendecompose_symmetric_matrix(Eigen::Matrix2d(ellipse.conic));
  const double min_eigenvalue = axes.values[0], max_eigenvalue = axes.values[1];
  if (!(min_eigenvalue * max_axis_ratio * max_axis_ratio > max_eigenvalue)) return std::nullopt;
  fit.center = circle->center + unit * ellipse.center;
  const Eigen::Vector2d semi_axes = axes.values.cwiseInverse().cwiseSqrt();
  fit.rim_from_circle =
      unit * Matrix2(axes.vectors * semi_axes.asDiagonal() * axes.vectors.transpose());
  return fit;
}

std::optional<RobustEllipse> fit_elongated_ellipse(std::span<const Eigen::Vector2d> points,
                                                   std::span<const double> weights,
                                                   double tolerance) {
  if (points.empty()) return std::nullopt;
  const auto count = static_cast<double>(points.size());
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) middle += point / count;
  Matrix2 scatter = Matrix2::Zero();
  for (const Eigen::Vector2d& point : points) {
    scatter += (point - middle) * (point - middle).transpose() / count;
  }
  const auto compute_square_root = [](const Matrix2& square) -> Matrix2 {
    const auto axes = eigendecompose_symmetric_matrix(Eigen::Matrix2d(square));
    return axes.vectors * axes.values.cwiseMax(0).cwiseSqrt().asDiagonal() *
           axes.vectors.transpose();
  };
  // Points distributed around an ellipse have the standard deviation semi-axis / sqrt(2) along each
  // axis.
  const Matrix2 to_points = std::numbers::sqrt2 * compute_square_root(scatter);
  const double mean_scale = std::sqrt(to_points.determinant());
  if (!(mean_scale > 0)) return std::nullopt;
  const Matrix2 from_points = to_points.inverse();
  std::vector<Eigen::Vector2d> scaled;
  scaled.reserve(points.size());
  for (const Eigen::Vector2d& point : points) scaled.emplace_back(from_points * (point - middle));
  auto fit = fit_robust_ellipse(scaled, weights, tolerance / mean_scale);
  if (!fit) return std::nullopt;
  const Matrix2 rim = to_points * fit->rim_from_circle;
  fit->center = middle + to_points * fit->center;
  fit->rim_from_circle = compute_square_root(rim * rim.transpose());
  fit->center_covariance = to_points * fit->center_covariance * to_points.transpose();
  return fit;
}

}  // namespace vlp
