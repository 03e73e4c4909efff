// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/three_lamp_poses.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace vlp {
namespace {

/// Returns a real root of x^3 + b x^2 + c x + d. Of three roots, approximately the one farthest
/// from the others, where the cubic is steep.
double compute_steep_root(double b, double c, double d) {
  const double inflection = -b / 3;
  const double slope = c - b * b / 3;  // at the inflection
  const double value = d + inflection * (c + inflection * (b + inflection));
  double x = inflection;
  if (slope < 0) {
    // Outside the two extrema, on the side of the root, the cubic is monotone.
    x += (value > 0 ? -1 : 1) * 2 * std::sqrt(-slope / 3);
  } else {
    // The root of t^3 + slope t + value is between 0 and both of these.
    const double by_cube = std::cbrt(std::abs(value));
    x += (value > 0 ? -1 : 1) * (slope > 0 ? std::min(by_cube, std::abs(value) / slope) : by_cube);
  }
  for (int i = 0; i < 60; ++i) {
    const double f = d + x * (c + x * (b + x));
    const double df = c + x * (2 * b + 3 * x);
    const double step = f / df;
    if (!std::isfinite(step)) break;
    x -= step;
    if (std::abs(step) <= 1e-14 * std::abs(x)) break;
  }
  return x;
}

/// Returns v^T A w for symmetric A.
double evaluate_bilinear(const Eigen::Matrix3d& a, const Eigen::Vector3d& v,
                         const Eigen::Vector3d& w) {
  return v.dot(a * w);
}

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& a) {
  Eigen::Matrix3d adj;  // a is symmetric, and so are its cofactors
  adj.col(0) = a.col(1).cross(a.col(2));
  adj.col(1) = a.col(2).cross(a.col(0));
  adj.col(2) = a.col(0).cross(a.col(1));
  return adj;
}

/// Returns the two lines whose product is the conic of rank two; std::nullopt if they are not
/// real.
int split_degenerate_conic(const Eigen::Matrix3d& conic, std::array<Eigen::Vector3d, 2>& lines) {
  const Eigen::Matrix3d adj = adjugate(conic);
  Eigen::Index i = 0;
  adj.diagonal().cwiseAbs().maxCoeff(&i);
  if (!(adj(i, i) < 0)) return 0;
  // adj = -p p^T for the lines' meeting point p; conic + [p]x has rank one: g h^T.
  const Eigen::Vector3d p = adj.col(i) / std::sqrt(-adj(i, i));
  Eigen::Matrix3d product = conic;
  product(0, 1) -= p.z(), product(0, 2) += p.y(), product(1, 2) -= p.x();
  product(1, 0) += p.z(), product(2, 0) -= p.y(), product(2, 1) += p.x();
  Eigen::Index row = 0, column = 0;
  product.cwiseAbs().maxCoeff(&row, &column);
  lines = {Eigen::Vector3d(product.row(row)), Eigen::Vector3d(product.col(column))};
  return 2;
}

struct Cones {
  Eigen::Matrix3d m01, m02, m12;  // of d^T m d = a
  double a01, a02, a12;
};

Cones make_cones(const std::array<Eigen::Vector3d, 3>& points_m,
                 const std::array<Eigen::Vector3d, 3>& rays) {
  const double c01 = rays[0].dot(rays[1]), c02 = rays[0].dot(rays[2]), c12 = rays[1].dot(rays[2]);
  Cones cones;
  cones.m01 << 1, -c01, 0, -c01, 1, 0, 0, 0, 0;
  cones.m02 << 1, 0, -c02, 0, 0, 0, -c02, 0, 1;
  cones.m12 << 0, 0, 0, 0, 1, -c12, 0, -c12, 1;
  cones.a01 = (points_m[0] - points_m[1]).squaredNorm();
  cones.a02 = (points_m[0] - points_m[2]).squaredNorm();
  cones.a12 = (points_m[1] - points_m[2]).squaredNorm();
  return cones;
}

/// Refines the distances by Newton steps on the three equations. Keeps them if these lead far away,
/// as near two solutions that have just vanished.
void refine_by_newton(const Cones& cones, Eigen::Vector3d& distances) {
  constexpr double max_change = 0.1;
  const Eigen::Vector3d start = distances;
  for (int i = 0; i < 3; ++i) {
    Eigen::Matrix3d jacobian;
    const Eigen::Vector3d d01 = cones.m01 * distances, d02 = cones.m02 * distances,
                          d12 = cones.m12 * distances;
    jacobian << d01.transpose(), d02.transpose(), d12.transpose();
    const Eigen::Vector3d residual(distances.dot(d01) - cones.a01, distances.dot(d02) - cones.a02,
                                   distances.dot(d12) - cones.a12);
    const Eigen::Vector3d step = 0.5 * (jacobian.inverse() * residual);
    distances -= step;
    if (!((distances - start).norm() <= max_change * start.norm())) {
      distances = start;
      return;
    }
    if (step.norm() <= 1e-9 * distances.norm()) return;  // the error is the square of the step
  }
}

/// Returns the frame of three points: columns along the first side, perpendicular to it in the
/// plane, and normal to the plane.
Eigen::Matrix3d compute_point_frame(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1,
                                    const Eigen::Vector3d& p2) {
  Eigen::Matrix3d frame;
  frame.col(0) = (p1 - p0).normalized();
  frame.col(2) = frame.col(0).cross(p2 - p0).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

}  // namespace

ThreeLampPoses solve_three_lamp_poses(const std::array<Eigen::Vector3d, 3>& points_m,
                                      const std::array<Eigen::Vector3d, 3>& rays) {
  ThreeLampPoses found;
  const Cones cones = make_cones(points_m, rays);
  Eigen::Matrix3d first = cones.a12 * cones.m01 - cones.a01 * cones.m12;
  Eigen::Matrix3d second = cones.a12 * cones.m02 - cones.a02 * cones.m12;
  // One conic is already a pair of lines if a lamp has equal distances and angles to both others.
  if (std::abs(first.determinant()) > std::abs(second.determinant())) std::swap(first, second);
  // det(first + x second) = 0.
  const Eigen::Matrix3d adj1 = adjugate(first), adj2 = adjugate(second);
  const double cubic = adj2.cwiseProduct(second).sum() / 3;
  const double quadratic = adj2.cwiseProduct(first).sum();
  const double linear = adj1.cwiseProduct(second).sum();
  const double constant = adj1.cwiseProduct(first).sum() / 3;
  const double x = compute_steep_root(quadratic / cubic, linear / cubic, constant / cubic);
  if (!std::isfinite(x)) return found;
  std::array<Eigen::Vector3d, 2> lines;
  const int count = split_degenerate_conic(first + x * second, lines);
  const Eigen::Matrix3d world_frame = compute_point_frame(points_m[0], points_m[1], points_m[2]);
  if (!(world_frame.col(2).squaredNorm() > 0)) return found;  // on one line
  for (int i = 0; i < count; ++i) {
    // Two directions span the line; the conic along a + s b is a quadratic in s.
    const Eigen::Vector3d line = lines[static_cast<std::size_t>(i)].normalized();
    const Eigen::Vector3d a = line.unitOrthogonal(), b = line.cross(a);
    const double faa = evaluate_bilinear(second, a, a), fab = evaluate_bilinear(second, a, b),
                 fbb = evaluate_bilinear(second, b, b);
    const double discriminant = fab * fab - faa * fbb;
    // Noise may remove two solutions; the point between them is an initial value close to both.
    constexpr double near = 0.5;
    if (!(discriminant >= -near * fab * fab)) continue;
    const double root = std::sqrt(std::max(0.0, discriminant));
    const double q = -(fab + std::copysign(root, fab));
    // Roots s = q / fbb and faa / q, as directions, so that none is infinite.
    const std::array<Eigen::Vector3d, 2> ratios{fbb * a + q * b, q * a + faa * b};
    for (const Eigen::Vector3d& ratio : std::span(ratios).first(root > 0 ? 2 : 1)) {
      if (found.count == 4) break;
      const Eigen::Vector3d towards = ratio.sum() < 0 ? Eigen::Vector3d(-ratio) : ratio;
      if (!(towards.minCoeff() > 0)) continue;
      const double scale = evaluate_bilinear(cones.m01, towards, towards) +
                           evaluate_bilinear(cones.m02, towards, towards) +
                           evaluate_bilinear(cones.m12, towards, towards);
      Eigen::Vector3d distances = std::sqrt((cones.a01 + cones.a02 + cones.a12) / scale) * towards;
      refine_by_newton(cones, distances);
      if (!(distances.minCoeff() > 0) || !distances.allFinite()) continue;
      const std::array<Eigen::Vector3d, 3> seen{distances[0] * rays[0], distances[1] * rays[1],
                                                distances[2] * rays[2]};
      const Eigen::Matrix3d seen_frame = compute_point_frame(seen[0], seen[1], seen[2]);
      if (!(seen_frame.col(2).squaredNorm() > 0)) continue;
      FreePose pose;
      pose.camera_from_world = seen_frame * world_frame.transpose();
      pose.position_m = points_m[0] - pose.camera_from_world.transpose() * seen[0];
      if (!pose.position_m.allFinite()) continue;
      found.poses[static_cast<std::size_t>(found.count++)] = pose;
    }
  }
  return found;
}

}  // namespace vlp
