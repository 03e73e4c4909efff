// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace vlp {

/// An edge as a lens with a Gaussian point spread shows it: from -1 to 1 with the distance from it.
///   value = erf(distance / (sqrt(2) blur))
struct BlurredStep {
  BlurredStep(double distance_px, double blur_px)
      : value(std::erf(distance_px / (std::numbers::sqrt2 * blur_px))),
        slope(std::sqrt(2 / std::numbers::pi) / blur_px *
              std::exp(-distance_px * distance_px / (2 * blur_px * blur_px))),
        by_blur(-distance_px / blur_px * slope) {}

  double value;
  /// Derivatives by the distance and by the blur.
  double slope, by_blur;
};

}  // namespace vlp
