// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace vlp {

/// What the lines of a light would show without stripes: between the brightest lines of stripes by
/// the line through their logarithms. `signal` is above the dark, line by line.
std::vector<double> envelope_of(const std::vector<double>& signal);

/// The lines' brightness over that envelope, where it is not lost in the dark.
std::vector<double> without_glow(const std::vector<double>& signal);

}  // namespace vlp
