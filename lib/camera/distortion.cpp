// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/distortion.h"

#include <cmath>
#include <limits>

namespace vlp {
namespace {

struct Radial {
  double factor;       // L
  double slope;        // dL / d r2
  double denominator;  // of L
};

Radial compute_radial(const std::array<double, 12>& k, double r2) {
  const double numerator = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double denominator = 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  const double inverse = 1 / denominator;
  const double factor = numerator * inverse;
  const double numerator_slope = k[0] + r2 * (2 * k[1] + r2 * (3 * k[4]));
  const double denominator_slope = k[5] + r2 * (2 * k[6] + r2 * (3 * k[7]));
  return {factor, (numerator_slope - factor * denominator_slope) * inverse, denominator};
}

}  // namespace

Distortion::Value Distortion::operator()(const Eigen::Vector2d& z) const {
  const double x = z.x(), y = z.y();
  const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
  const double p1 = k[2], p2 = k[3];
  const Radial l = compute_radial(k, r2);
  const double prism_x = 2 * (k[8] + 2 * k[9] * r2), prism_y = 2 * (k[10] + 2 * k[11] * r2);
  Value value;
  value.distorted = {x * l.factor + 2 * p1 * xy + p2 * (r2 + 2 * xx) + r2 * (k[8] + k[9] * r2),
                     y * l.factor + p1 * (r2 + 2 * yy) + 2 * p2 * xy + r2 * (k[10] + k[11] * r2)};
  const double mixed = 2 * (xy * l.slope + p1 * x + p2 * y);
  value.d_distorted_d_z << l.factor + 2 * xx * l.slope + 2 * p1 * y + 6 * p2 * x + prism_x * x,
      mixed + prism_x * y,  //
      mixed + prism_y * x,  //
      l.factor + 2 * yy * l.slope + 6 * p1 * y + 2 * p2 * x + prism_y * y;
  return value;
}

Eigen::Matrix<double, 2, 12> Distortion::coefficient_jacobian(const Eigen::Vector2d& z) const {
  const double r2 = z.squaredNorm(), r4 = r2 * r2, r6 = r4 * r2, xy2 = 2 * z.x() * z.y();
  const Radial l = compute_radial(k, r2);
  const double d_factor_d_numerator = 1 / l.denominator,
               d_factor_d_denominator = -l.factor / l.denominator;
  Eigen::Matrix<double, 2, 12> jacobian = Eigen::Matrix<double, 2, 12>::Zero();
  jacobian.col(0) = z * (r2 * d_factor_d_numerator);
  jacobian.col(1) = z * (r4 * d_factor_d_numerator);
  jacobian.col(2) << xy2, r2 + 2 * z.y() * z.y();
  jacobian.col(3) << r2 + 2 * z.x() * z.x(), xy2;
  jacobian.col(4) = z * (r6 * d_factor_d_numerator);
  jacobian.col(5) = z * (r2 * d_factor_d_denominator);
  jacobian.col(6) = z * (r4 * d_factor_d_denominator);
  jacobian.col(7) = z * (r6 * d_factor_d_denominator);
  jacobian.row(0).segment<2>(8) << r2, r4;
  jacobian.row(1).segment<2>(10) << r2, r4;
  return jacobian;
}

double Distortion::compute_max_radius() const {
  // Rate at which the distorted point moves outwards along a line through the origin in direction
  // u:
  //   L + 2 r2 L' + r u.w,
  // with w from the tangential and prism terms. It is smallest for u = -w / |w|.
  const auto is_monotonic = [this](double r) {
    const Radial l = compute_radial(k, r * r);
    const double w_x = 6 * k[3] + 2 * k[8] + 4 * r * r * k[9];
    const double w_y = 6 * k[2] + 2 * k[10] + 4 * r * r * k[11];
    return l.denominator > 0 && l.factor + 2 * r * r * l.slope > r * std::hypot(w_x, w_y);
  };
  constexpr double step = 0.01;
  for (int i = 1; i * step <= searched_radius; ++i) {
    if (is_monotonic(i * step)) continue;
    double inside = (i - 1) * step, outside = i * step;
    while (outside - inside > 1e-12) {
      const double middle = (inside + outside) / 2;
      (is_monotonic(middle) ? inside : outside) = middle;
    }
    return inside;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace vlp
