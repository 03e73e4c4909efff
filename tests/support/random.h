// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace vlp {

/// Random numbers that are identical for every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Returns a number in [min, max).
  double uniform(double min, double max) {
    return min + (max - min) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  /// Returns an index in [0, count).
  std::size_t index(std::size_t count) { return engine_() % count; }
  double normal() {  // Box and Muller
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    return radius * std::cos(uniform(0, 2 * std::numbers::pi));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace vlp
