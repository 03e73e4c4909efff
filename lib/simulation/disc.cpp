// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/disc.h"

#include <algorithm>
#include <cmath>

namespace vlp {

double Disc::integrate_triangle(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  return cross(p, q) * (0.5 - fall_ / 12 * (p.squaredNorm() + p.dot(q) + q.squaredNorm()));
}

double Disc::integrate_sector(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
  return std::atan2(cross(p, q), p.dot(q)) * (0.5 - fall_ / 4);
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
