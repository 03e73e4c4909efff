// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Formats a number with `digits` digits after the point.
std::string fixed(double value, int digits);
/// Formats a number with `digits` significant digits.
std::string significant(double value, int digits);

}  // namespace vlp
