// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace vlp {

/// The largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... that is no larger, but for rounding.
/// Precondition: value > 0.
double round_below(double value);

/// Those numbers in turn, two or more, from the last that is no larger than `least` to the first
/// that is no smaller than `most`. Precondition: 0 < least <= most.
std::vector<double> round_numbers(double least, double most);

/// For people: that many significant digits, but all of those before the point and no exponent for
/// it.
std::string readable(double value, int digits);

/// A length in millimetres for people, to three digits: readable, or, as one in a column of its
/// like, with all three and the unit.
std::string readable_mm(double length_m);
std::string in_mm(double length_m);

}  // namespace vlp
