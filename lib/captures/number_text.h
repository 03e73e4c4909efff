// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// A number with so many digits after the point.
std::string fixed(double value, int digits);
/// A number with so many significant digits.
std::string significant(double value, int digits);

}  // namespace vlp
