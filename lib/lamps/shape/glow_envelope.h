// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace vlp {

/// What the lines of a light would show without stripes: between the brightest lines of stripes by
/// the line through their logarithms. `signal` is above the dark, line by line.
std::vector<double> envelope_of(const std::vector<double>& signal);

/// The lines' brightness over that envelope, from 0 to 1, where it is not lost in the dark.
std::vector<double> without_glow(const std::vector<double>& signal);

/// From the first line of half that brightness to the last. Where the first stripe begins and the
/// last one ends may be where the light does; with less than four stripes, which need those ends,
/// from two lines before to two after.
std::vector<double> striped_part(const std::vector<double>& brightness);

}  // namespace vlp
