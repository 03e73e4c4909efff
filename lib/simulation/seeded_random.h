// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string_view>

namespace vlp {

/// Random numbers that depend on a seed, a name and an index alone; the same on every machine.
cv::RNG random_of(std::uint64_t seed, std::string_view name, std::size_t index);

std::uint64_t next_seed(cv::RNG& random);

}  // namespace vlp
