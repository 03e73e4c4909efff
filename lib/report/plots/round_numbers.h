// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace vlp {

/// Returns the largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... that does not exceed `value`, except for
/// rounding.
/// @pre value > 0
double round_below(double value);

/// Returns consecutive numbers of that series, at least two. The first is the last one that does
/// not exceed `lowest`, the last is the first one that is not below `highest`.
/// @pre 0 < least <= most
std::vector<double> round_numbers(double lowest, double highest);

/// Formats a number for humans with `digits` significant digits. Integer digits are all kept, so
/// that large numbers have no exponent.
std::string readable(double value, int digits);

/// Format a length in millimeters with three significant digits. format_mm() has no unit and
/// keeps all integer digits, as readable(). format_mm_with_unit() appends the unit and is for
/// columns.
std::string format_mm(double length_m);
std::string format_mm_with_unit(double length_m);

}  // namespace vlp
