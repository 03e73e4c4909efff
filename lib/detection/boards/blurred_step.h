// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace vlp {

/// erf(x) and its derivative to 1e-11, of which the edges of tags take most of their time: by
/// Taylor's series about the nearest of many places.
struct ErrorFunction {
  explicit ErrorFunction(double x);

  double value, slope;
};

/// Of a Gaussian point spread: the inverses of its standard deviation and of sqrt(2) times that.
struct Blur {
  explicit Blur(double px) : per_px(1 / px), per_scale(per_px / std::numbers::sqrt2) {}

  double per_px, per_scale;
};

/// An edge as a lens with a Gaussian point spread shows it: from -1 to 1 with the distance from it.
///   value = erf(distance / (sqrt(2) blur))
struct BlurredStep {
  BlurredStep(double distance_px, const Blur& blur) {
    const ErrorFunction erf(distance_px * blur.per_scale);
    value = erf.value;
    slope = erf.slope * blur.per_scale;
    by_blur = -distance_px * blur.per_px * slope;
    const double u = distance_px * blur.per_px;
    by_kurtosis = (3 - u * u) / 24 * distance_px * slope;
  }

  double value;
  /// Derivatives by the distance, by the blur and by the excess kurtosis k of the line spread
  ///   exp(-u^2 / 2) (1 + k (u^4 - 6 u^2 + 3) / 24) / (sqrt(2 pi) blur),     u = distance / blur,
  /// at k = 0 (Gram-Charlier series).
  double slope, by_blur, by_kurtosis;
};

}  // namespace vlp
