// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/fisheye.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vlp {

double Fisheye::compute_max_angle_rad() const {
  constexpr int steps = 400;
  constexpr double step = std::numbers::pi / steps;
  for (int i = 1; i <= steps; ++i) {
    if (radius_derivative(i * step) > 0) continue;
    double inside = (i - 1) * step, outside = i * step;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (inside + outside) / 2;
      (radius_derivative(middle) > 0 ? inside : outside) = middle;
    }
    return inside;
  }
  return std::numbers::pi;
}

double Fisheye::angle_from_radius_rad(double at_distance, double valid_rad,
                                      double start_rad) const {
  constexpr double numeric_tolerance = 1e-14;  // relative, for distances at the very end
  if (!(at_distance <= radius_from_angle(valid_rad) * (1 + numeric_tolerance))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double low = 0, high = valid_rad, angle = start_rad;
  constexpr int max_iterations = 60;
  for (int i = 0; i < max_iterations; ++i) {
    const double error = radius_from_angle(angle) - at_distance;
    (error > 0 ? high : low) = angle;
    double next = angle - error / radius_derivative(angle);
    const bool by_newton = next >= low && next <= high;
    if (!by_newton) next = (low + high) / 2;
    const double moved = std::abs(next - angle);
    angle = next;
    if (moved <= (by_newton ? 1e-7 : 1e-14) * angle) break;  // Newton's error is the square of it
  }
  return std::clamp(angle, 0.0, valid_rad);
}

FisheyeAngles::FisheyeAngles(const Fisheye& fisheye)
    : fisheye_(fisheye), valid_rad_(fisheye.compute_max_angle_rad()) {
  const double interval = fisheye.radius_from_angle(valid_rad_) / kIntervals;
  intervals_per_distance_ = 1 / interval;
  double from = 0, from_slope = interval / fisheye.radius_derivative(0);
  for (int i = 0; i < kIntervals; ++i) {
    const double start = std::min(from + from_slope, valid_rad_);
    const double to = i + 1 == kIntervals
                          ? valid_rad_
                          : fisheye.angle_from_radius_rad((i + 1) * interval, valid_rad_, start);
    // At a fold the slope of the angle is infinite.
    const double difference = to - from, steepest = 3 * difference;
    const double slope = fisheye.radius_derivative(to);
    const double to_slope = slope > 0 ? std::min(interval / slope, steepest) : steepest;
    initial_angles_[static_cast<std::size_t>(i)] = {from, from_slope,
                                                    3 * difference - 2 * from_slope - to_slope,
                                                    from_slope + to_slope - 2 * difference};
    from = to, from_slope = to_slope;
  }
}

double FisheyeAngles::look_up_angle_rad(double distance) const {
  const double at = distance * intervals_per_distance_;
  const int interval = at < kIntervals ? static_cast<int>(at) : kIntervals - 1;
  const double x = at - interval;
  const auto& [a, b, c, d] = initial_angles_[static_cast<std::size_t>(interval)];
  // This order returns 0 for NaN.
  return std::min(valid_rad_, std::max(0.0, a + x * (b + x * (c + x * d))));
}

}  // namespace vlp
