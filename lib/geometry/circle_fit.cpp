// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/circle_fit.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace vlp {
namespace {

Eigen::Vector2d compute_mean(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& point : points) mean += point / static_cast<double>(points.size());
  return mean;
}

/// Fits a circle by Taubin's method, relative to the mean of the points: the smallest root of
/// Chernov's characteristic polynomial.
std::optional<Circle> fit_taubin(std::span<const Eigen::Vector2d> points,
                                 const Eigen::Vector2d& mean) {
  const double n = static_cast<double>(points.size());
  double xx = 0, yy = 0, xy = 0, xz = 0, yz = 0, zz = 0;
  for (const auto& point : points) {
    const Eigen::Vector2d p = point - mean;
    const double z = p.squaredNorm();
    xx += p.x() * p.x() / n, yy += p.y() * p.y() / n, xy += p.x() * p.y() / n;
    xz += p.x() * z / n, yz += p.y() * z / n, zz += z * z / n;
  }
  const double z = xx + yy, cov = xx * yy - xy * xy, var = zz - z * z;
  // The covariance of points on one line is singular, within the rounding of sums and coordinates.
  constexpr double numeric_tolerance = 8 * std::numeric_limits<double>::epsilon();
  const double coordinate_variance =
      numeric_tolerance * numeric_tolerance * (mean.squaredNorm() + z);
  if (!(cov > z * (1e-14 * z + coordinate_variance))) return std::nullopt;

  const double a3 = 4 * z, a2 = -3 * z * z - zz;
  const double a1 = var * z + 4 * cov * z - xz * xz - yz * yz;
  const double a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - var * cov;
  double root = 0, value = a0;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double slope = a1 + root * (2 * a2 + 3 * a3 * root);
    const double next = root - value / slope;
    if (next == root || !std::isfinite(next)) break;
    const double next_value = a0 + next * (a1 + next * (a2 + next * a3));
    if (std::abs(next_value) >= std::abs(value)) break;
    root = next, value = next_value;
  }
  const double det = root * root - root * z + cov;
  const Eigen::Vector2d center =
      Eigen::Vector2d(xz * (yy - root) - yz * xy, yz * (xx - root) - xz * xy) / (2 * det);
  if (!center.allFinite()) return std::nullopt;
  return Circle{center, std::sqrt(center.squaredNorm() + z)};
}

}  // namespace

std::optional<CircleFit> fit_circle(std::span<const Eigen::Vector2d> points) {
  if (points.size() < 3) return std::nullopt;
  const Eigen::Vector2d mean = compute_mean(points);
  const auto start = fit_taubin(points, mean);
  if (!start) return std::nullopt;

  CircleFit fit{*start, 0, {}, false};
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  double sum_of_squares = 0;
  for (int iteration = 0; iteration < 100 && !fit.converged; ++iteration) {
    normal.setZero();
    sum_of_squares = 0;
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const auto& point : points) {
      const Eigen::Vector2d radial = point - mean - fit.circle.center;
      const double distance = radial.norm();
      if (!(distance > 0)) continue;  // a point at the center has no radial direction
      const double residual = distance - fit.circle.radius;
      const Eigen::Vector3d row(-radial.x() / distance, -radial.y() / distance, -1);
      normal += row * row.transpose();
      gradient += row * residual;
      sum_of_squares += residual * residual;
    }
    const Eigen::Vector3d step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    fit.circle.center += step.head<2>();
    fit.circle.radius += step.z();
    fit.converged = step.norm() < 1e-10 * fit.circle.radius;
  }
  fit.circle.center += mean;
  const double n = static_cast<double>(points.size());
  fit.rms = std::sqrt(sum_of_squares / n);
  if (points.size() > 3) {
    fit.center_covariance = sum_of_squares / (n - 3) * normal.inverse().topLeftCorner<2, 2>();
  } else {
    fit.center_covariance.setConstant(std::numeric_limits<double>::infinity());
  }
  return fit;
}

}  // namespace vlp
