// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace vlp {

/// Value and derivative of erf(x), accurate to 1e-11, by a Taylor series about the nearest of many
/// tabulated positions. Fits of tag edges spend most of their time in it.
struct ErrorFunction {
  explicit ErrorFunction(double x) {
    const double size = std::min(kLargest, std::abs(x));  // kLargest for NaN
    const auto nearest = static_cast<std::size_t>(size * kPerUnit);
    const Series& c = kIntervals[nearest];
    const double d = size - interval_center(nearest);
    value = std::copysign(c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5])))), x);
    slope = c[1] + d * (2 * c[2] + d * (3 * c[3] + d * (4 * c[4] + d * (5 * c[5]))));
  }

  double value, slope;

 private:
  static constexpr int kPerUnit = 64;
  static constexpr double kLargest = 6;  // beyond, erf is 1 to the last digit
  /// Taylor coefficients: erf(x) = c0 + c1 d + ... + c5 d^5, with d relative to the center of an
  /// interval.
  using Series = std::array<double, 6>;
  using Intervals = std::array<Series, static_cast<std::size_t>(kLargest) * kPerUnit + 1>;

  static double interval_center(std::size_t interval) {
    return (static_cast<double>(interval) + 0.5) / kPerUnit;
  }
  static Intervals tabulate();

  static const Intervals kIntervals;
};

/// Gaussian point spread with the standard deviation `px` > 0, stored as reciprocals in 1/px:
/// `per_px` = 1 / px, `per_scale` = 1 / (sqrt(2) px).
struct Blur {
  explicit Blur(double px) : per_px(1 / px), per_scale(per_px / std::numbers::sqrt2) {}

  double per_px, per_scale;
};

/// Step from -1 to 1 blurred by a Gaussian point spread, at a distance from the edge in px:
///   value = erf(distance / (sqrt(2) blur))
struct BlurredStep {
  BlurredStep(double distance_px, const Blur& blur) {
    const ErrorFunction erf(distance_px * blur.per_scale);
    value = erf.value;
    slope = erf.slope * blur.per_scale;
    d_value_d_blur = -distance_px * blur.per_px * slope;
    const double u = distance_px * blur.per_px;
    d_value_d_kurtosis = (3 - u * u) / 24 * distance_px * slope;
  }

  double value;
  /// Derivatives with respect to the distance (`slope`), the blur and the excess kurtosis k of the
  /// line spread, at k = 0 (Gram-Charlier series):
  ///   exp(-u^2 / 2) (1 + k (u^4 - 6 u^2 + 3) / 24) / (sqrt(2 pi) blur),     u = distance / blur.
  double slope, d_value_d_blur, d_value_d_kurtosis;
};

}  // namespace vlp
