// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Formats a number with `digits` digits after the point.
std::string format_fixed_decimals(double value, int digits);
/// Formats a number with at most `digits` significant digits, as printf's %g: without trailing
/// zeros, with an exponent if it is very small or has more integer digits.
std::string format_digits(double value, int digits);

}  // namespace vlp
