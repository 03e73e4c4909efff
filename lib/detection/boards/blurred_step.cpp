// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/blurred_step.h"

#include <algorithm>
#include <array>

namespace vlp {
namespace {

constexpr int kPerUnit = 64;
constexpr double kLargest = 6;  // beyond, erf is 1 to the last digit

struct Place {
  double value, slope;
};

/// Of the interval that a place is for.
double middle_of(std::size_t place) { return (double(place) + 0.5) / kPerUnit; }

const auto places = [] {
  std::array<Place, static_cast<std::size_t>(kLargest) * kPerUnit + 1> all{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double x = middle_of(i);
    all[i] = {std::erf(x), 2 * std::numbers::inv_sqrtpi * std::exp(-x * x)};
  }
  return all;
}();

}  // namespace

ErrorFunction::ErrorFunction(double x) {
  const double size = std::min(kLargest, std::abs(x));  // of no number, too
  const auto nearest = static_cast<std::size_t>(size * kPerUnit);
  const auto& [at, g] = places[nearest];
  // The slope's derivatives, over the slope: Hermite's polynomials.
  const double a = middle_of(nearest), d = size - a, square = a * a;
  const double first = -2 * a, second = 4 * square - 2, third = a * (12 - 8 * square);
  const double fourth = 12 + square * (16 * square - 48);
  value = std::copysign(
      at + g * d * (1 + d / 2 * (first + d / 3 * (second + d / 4 * (third + d / 5 * fourth)))), x);
  slope = g * (1 + d * (first + d / 2 * (second + d / 3 * (third + d / 4 * fourth))));
}

}  // namespace vlp
