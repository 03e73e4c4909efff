// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string_view>

namespace vlp {

/// Returns a random generator seeded by a seed, a name and an index alone; the same on every
/// machine.
cv::RNG make_random(std::uint64_t seed, std::string_view name, std::size_t index);

/// Draws a seed of 64 bits.
std::uint64_t draw_seed_from(cv::RNG& random);

}  // namespace vlp
