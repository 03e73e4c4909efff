// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "captures/fixes_table.h"

namespace vlp {

/// Returns a row with a fix.
inline FixRow fix_at(const std::string& image, double x_m, double y_m, double z_m = 0,
                     double yaw_rad = 0) {
  return {image, "ok", FixRow::Fix{{{x_m, y_m, z_m}, yaw_rad}, {}, 0}, 3, 1};
}
/// Returns a row without a fix.
inline FixRow no_fix(const std::string& image, const std::string& status) {
  return {image, status, {}, 0, 1};
}

}  // namespace vlp
