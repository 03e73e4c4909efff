// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/robust_circle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vlp {
namespace {

constexpr int kLeast = 5;

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

double distance(const Circle& circle, const Eigen::Vector2d& point) {
  return (point - circle.center).norm() - circle.radius;
}

/// The circle through three of the points that has most points close to it.
std::optional<Circle> best_supported(std::span<const Eigen::Vector2d> points, double tolerance) {
  constexpr int triples = 40;
  std::optional<Circle> best;
  int most = kLeast - 1;
  const std::size_t n = points.size();
  Eigen::Vector2d low = points[0], high = points[0];
  for (const Eigen::Vector2d& point : points)
    low = low.cwiseMin(point), high = high.cwiseMax(point);
  const double largest = (high - low).norm();
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<std::size_t>(state >> 8) % n;
  };
  for (int i = 0; i < triples; ++i) {
    const std::size_t a = next(), b = next(), c = next();
    const auto circle = through(points[a], points[b], points[c]);
    if (!circle || circle->radius > largest) continue;
    int count = 0;
    for (const Eigen::Vector2d& point : points) {
      count += std::abs(distance(*circle, point)) < tolerance;
    }
    if (count > most) most = count, best = circle;
  }
  return best;
}

}  // namespace

std::optional<RobustCircle> fit_robust_circle(std::span<const Eigen::Vector2d> points,
                                              std::span<const double> weights, double tolerance) {
  if (points.size() < kLeast) return std::nullopt;
  const auto begin = best_supported(points, tolerance);
  if (!begin) return std::nullopt;
  RobustCircle fit{*begin, {}, std::vector<bool>(points.size()), 0, 0};
  std::vector<double> sizes;
  for (int round = 0; round < 5; ++round) {
    // The scale is the median distance of those that may belong to the circle at all.
    sizes.clear();
    for (const Eigen::Vector2d& point : points) {
      const double size = std::abs(distance(fit.circle, point));
      if (size < 4 * tolerance) sizes.push_back(size);
    }
    if (sizes.size() < kLeast) return std::nullopt;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    constexpr double sigma_from_median = 1.4826, tukey = 4.685;
    const double cut =
        std::min(4 * tolerance, tukey * std::max(sigma_from_median * *middle, tolerance / 10));
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double sum = 0, squares = 0, all = 0, psi_squares = 0, slopes = 0;
    fit.count = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d away = points[i] - fit.circle.center;
      const double norm = away.norm(), error = norm - fit.circle.radius;
      const double share = error / cut;
      fit.inliers[i] = std::abs(share) < 1 && norm > 0;
      if (!fit.inliers[i]) continue;
      const double inside = 1 - share * share;
      const double weight = weights[i] * inside * inside;
      all += weights[i];
      psi_squares += weights[i] * std::pow(inside * inside * error, 2);
      slopes += weights[i] * inside * (1 - 5 * share * share);
      squares += error * error;
      const Eigen::Vector3d slope(-away.x() / norm, -away.y() / norm, -1);
      normal += weight * slope * slope.transpose();
      gradient += weight * error * slope;
      sum += weight;
      ++fit.count;
    }
    if (fit.count < kLeast || !(slopes > 0)) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    if (!(solver.vectorD().minCoeff() > 1e-12 * sum)) return std::nullopt;
    const Eigen::Vector3d step = solver.solve(gradient);
    fit.circle.center -= step.head<2>();
    fit.circle.radius -= step[2];
    fit.rms = std::sqrt(squares / fit.count);
    // Of an M-estimate: the mean of psi^2 over the squared mean of its slope (Huber 1981).
    const double variance = psi_squares * all / (slopes * slopes) * fit.count / (fit.count - 3);
    const Eigen::Matrix3d covariance =
        solver.solve(Eigen::Matrix3d::Identity()) * (variance * sum / fit.count);
    fit.center_covariance = covariance.topLeftCorner<2, 2>();
  }
  if (!(fit.circle.radius > 0) || !fit.circle.center.allFinite()) return std::nullopt;
  return fit;
}

}  // namespace vlp
