// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/robust_circle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "lamps/shape/m_estimate.h"

namespace vlp {
namespace {

constexpr int kMinPoints = 5;

std::optional<Circle> through(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
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
std::optional<Circle> best_supported(std::span<const Eigen::Vector2d> points, double tolerance) {
  constexpr int triples = 40;
  std::optional<Circle> best;
  double max_score = kMinPoints - 1;
  const std::size_t n = points.size();
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : points) box.extend(point);
  const double largest = box.diagonal().norm();
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<std::size_t>(state >> 8) % n;
  };
  for (int i = 0; i < triples; ++i) {
    const std::size_t a = next(), b = next(), c = next();
    const auto circle = through(points[a], points[b], points[c]);
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

}  // namespace

std::optional<RobustCircle> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                              std::span<const double> weights, double tolerance) {
  if (points.size() < kMinPoints) return std::nullopt;
  const auto begin = best_supported(points, tolerance);
  if (!begin) return std::nullopt;
  RobustCircle fit{*begin, {}, {}, 0, 0};
  for (int iteration = 0; iteration < 5; ++iteration) {
    auto better = compute_m_estimate_step<3>(weights, tolerance, [&](std::size_t i) {
      const Eigen::Vector2d away = points[i] - fit.circle.center;
      const double norm = std::max(away.norm(), std::numeric_limits<double>::min());
      return CurveDistance<3>{norm - fit.circle.radius, {-away.x() / norm, -away.y() / norm, -1}};
    });
    if (!better) return std::nullopt;
    fit.circle.center -= better->step.head<2>();
    fit.circle.radius -= better->step[2];
    fit.center_covariance = better->covariance.topLeftCorner<2, 2>();
    fit.inliers = std::move(better->inliers);
    fit.count = better->count;
    fit.rms = better->rms;
    if (better->step.norm() < 1e-3 * tolerance) break;
  }
  if (!(fit.circle.radius > 0) || !fit.circle.center.allFinite()) return std::nullopt;
  return fit;
}

}  // namespace vlp
