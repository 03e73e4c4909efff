// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/blurred_step.h"

namespace vlp {

ErrorFunction::Intervals ErrorFunction::tabulate() {
  Intervals all{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double a = interval_center(i), square = a * a;
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
}

const ErrorFunction::Intervals ErrorFunction::kIntervals = ErrorFunction::tabulate();

}  // namespace vlp
