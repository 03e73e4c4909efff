// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/number_text.h"

#include <fmt/core.h>

namespace vlp {

std::string format_fixed_decimals(double value, int digits) {
  return fmt::format("{:.{}f}", value, digits);
}

std::string format_digits(double value, int digits) {
  return fmt::format("{:.{}g}", value, digits);
}

}  // namespace vlp
