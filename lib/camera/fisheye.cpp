// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/fisheye.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vlp {

double Fisheye::valid_angle_rad() const {
  constexpr int steps = 400;
  constexpr double step = std::numbers::pi / steps;
  for (int i = 1; i <= steps; ++i) {
    if (slope(i * step) > 0) continue;
    double inside = (i - 1) * step, outside = i * step;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (inside + outside) / 2;
      (slope(middle) > 0 ? inside : outside) = middle;
    }
    return inside;
  }
  return std::numbers::pi;
}

std::optional<double> Fisheye::angle_rad(double at_distance, double valid_rad) const {
  constexpr double rounding = 1e-14;  // of the distance at the very end, from which it came
  if (!(at_distance <= distance(valid_rad) * (1 + rounding))) return std::nullopt;
  double low = 0, high = valid_rad, angle = std::min(at_distance, valid_rad);
  constexpr int most_steps = 60;
  for (int i = 0; i < most_steps; ++i) {
    const double error = distance(angle) - at_distance;
    (error > 0 ? high : low) = angle;
    double next = angle - error / slope(angle);
    if (!(next >= low && next <= high)) next = (low + high) / 2;
    const double moved = std::abs(next - angle);
    angle = next;
    if (moved <= 1e-9 * angle) {  // Newton squares it
      if (moved > 0) angle -= (distance(angle) - at_distance) / slope(angle);
      break;
    }
  }
  return std::clamp(angle, 0.0, valid_rad);
}

}  // namespace vlp
