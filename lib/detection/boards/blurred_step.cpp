// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/blurred_step.h"

#include <algorithm>
#include <array>

namespace vlp {
namespace {

constexpr int kPerUnit = 64;
constexpr double kLargest = 6;  // beyond, erf is 1 to the last digit

/// Taylor coefficients: erf(x) = c0 + c1 d + ... + c5 d^5, with d relative to the center of an
/// interval.
using Series = std::array<double, 6>;

double compute_interval_center(std::size_t interval) { return (double(interval) + 0.5) / kPerUnit; }

const auto intervals = [] {
  std::array<Series, static_cast<std::size_t>(kLargest) * kPerUnit + 1> all{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double a = compute_interval_center(i), square = a * a;
    const double g = 2 * std::numbers::inv_sqrtpi * std::exp(-square);
    // The ratios of the derivatives to the slope are Hermite polynomials.
    all[i] = {std::erf(a),
              g,
              g * -2 * a / 2,
              g * (4 * square - 2) / 6,
              g * a * (12 - 8 * square) / 24,
              g * (12 + square * (16 * square - 48)) / 120};
  }
  return all;
}();

}  // namespace

ErrorFunction::ErrorFunction(double x) {
  const double size = std::min(kLargest, std::abs(x));  // kLargest for NaN
  const auto nearest = static_cast<std::size_t>(size * kPerUnit);
  const Series& c = intervals[nearest];
  const double d = size - compute_interval_center(nearest);
  value = std::copysign(c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5])))), x);
  slope = c[1] + d * (2 * c[2] + d * (3 * c[3] + d * (4 * c[4] + d * (5 * c[5]))));
}

}  // namespace vlp
