// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace vlp {

/// Returns the step, at least 1, for which every step-th of `count` items are no more than
/// `max_count` items.
/// @pre max_count > 0
std::size_t thinning_step(std::size_t count, std::size_t max_count);

/// Returns "every 3rd of 250 drawn"; empty for a step of 1.
std::string thinning_note(std::size_t count, std::size_t step);

/// Returns the ascending indices of every step-th value and of the `largest` largest values.
std::vector<std::size_t> select_every_nth_and_largest(std::span<const double> values,
                                                      std::size_t step, std::size_t largest);

}  // namespace vlp
