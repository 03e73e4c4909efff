// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>

#include "simulation/coverage.h"

namespace vlp {

/// Disc around the origin with the radiance 1 - (1 - rim_to_center_ratio) (r / radius)^2. An
/// ellipse with axes along x and y is a disc in units of its half axes.
class Disc {
 public:
  Disc(const Eigen::Vector2d& half_axes_m, double rim_to_center_ratio)
      : half_axes_m_(half_axes_m), fall_(1 - rim_to_center_ratio) {}

  Eigen::Vector2d hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return plane_hit(origin, direction).cwiseQuotient(half_axes_m_);
  }

  Eigen::AlignedBox2d bounds() const {
    return {Eigen::Vector2d::Constant(-1), Eigen::Vector2d::Constant(1)};
  }

  /// Returns the integral over the part of the triangle (0, p, q) inside the disc, in units of the
  /// radius. add_shape() needs no other triangles.
  ///   Triangle inside: the area (p x q) / 2; of r^2, (p x q) (p p + p q + q q) / 12.
  ///   Sector of angle a: the area a / 2; of r^2, a / 4.
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

 private:
  double integrate_triangle(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;
  double integrate_sector(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const;

  Eigen::Vector2d half_axes_m_;
  double fall_;
};

}  // namespace vlp
