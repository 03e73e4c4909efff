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

/// An edge as a lens with a Gaussian point spread shows it: from -1 to 1 with the distance from it.
///   value = erf(distance / (sqrt(2) blur))
struct BlurredStep {
  BlurredStep(double distance_px, double blur_px)
      : BlurredStep(ErrorFunction(distance_px / (std::numbers::sqrt2 * blur_px)),
                    distance_px / blur_px, std::numbers::sqrt2 * blur_px) {}

  double value;
  /// Derivatives by the distance and by the blur.
  double slope, by_blur;

 private:
  BlurredStep(const ErrorFunction& erf, double blurs, double scale_px)
      : value(erf.value), slope(erf.slope / scale_px), by_blur(-blurs * slope) {}
};

}  // namespace vlp
