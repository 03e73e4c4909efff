// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace vlp {

constexpr double rad_from_deg(double angle_deg) { return angle_deg * (std::numbers::pi / 180.0); }
constexpr double deg_from_rad(double angle_rad) { return angle_rad * (180.0 / std::numbers::pi); }

/// Returns the equivalent angle in [-pi, pi], rad, which differs by a multiple of 2 pi. An angle in
/// this range is returned unchanged.
inline double wrap_angle_rad(double angle_rad) {
  return std::abs(angle_rad) <= std::numbers::pi ? angle_rad
                                                 : std::remainder(angle_rad, 2 * std::numbers::pi);
}

}  // namespace vlp
