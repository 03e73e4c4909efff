// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace vlp {

/// Every how many-th of `count` things to draw so that no more than `most` are drawn: 1 or more.
/// Precondition: most > 0.
std::size_t thinning_step(std::size_t count, std::size_t most);

/// "every 3rd of 250 drawn"; empty for a step of 1.
std::string thinning_note(std::size_t count, std::size_t step);

/// Which to draw: every step-th and so many of the largest, in their order.
std::vector<std::size_t> thinned(std::span<const double> values, std::size_t step,
                                 std::size_t largest);

}  // namespace vlp
