// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/two_lamp_fix.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vlp {
namespace {

/// Computes the real roots of a x^2 + 2 b x + c, a > 0, without cancellation.
struct Roots {
  int count = 0;
  std::array<double, 2> values{};
};

Roots solve_quadratic(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return {};
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (discriminant == 0) return {1, {q / a}};
  return {2, {q / a, c / q}};
}

}  // namespace

TwoLampPoses compute_two_lamp_poses(const Sighting& first, const Sighting& second) {
  const Eigen::Vector2d d = (second.lamp_m - first.lamp_m).head<2>();
  const Eigen::Vector2d difference = second.z - first.z;
  const double h = second.lamp_m.z() - first.lamp_m.z();
  TwoLampPoses fix;
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  const double a = difference.squaredNorm();
  if (!(a > rounding * rounding * (first.z.squaredNorm() + second.z.squaredNorm()))) return fix;

  const Roots heights = solve_quadratic(a, h * difference.dot(second.z),
                                        h * h * second.z.squaredNorm() - d.squaredNorm());
  for (int i = 0; i < heights.count; ++i) {
    const double height_m = heights.values[static_cast<std::size_t>(i)];
    if (!(height_m > 0) || !(height_m + h > 0)) {
      fix.lamp_below_camera = true;
      continue;
    }
    const Eigen::Vector2d level_d = height_m * difference + h * second.z;
    const Eigen::Vector2d turn = conj_product(level_d, d);
    const double length = turn.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector2d heading = turn / length;
    const Eigen::Vector2d s = first.lamp_m.head<2>() - height_m * complex_product(heading, first.z);
    fix.poses[static_cast<std::size_t>(fix.count++)] =
        LevelPose({s.x(), s.y(), first.lamp_m.z() - height_m}, heading).pose();
  }
  fix.lamp_below_camera = fix.lamp_below_camera && fix.count == 0;
  return fix;
}

}  // namespace vlp
