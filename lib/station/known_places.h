// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "captures/captures_table.h"

namespace vlp {

/// Where captures of a step were, by image: captures.csv of its folder, else truth.csv, else
/// nothing. Throws InputError for a table that cannot be read.
CapturesTable places_in(const std::filesystem::path& folder);

/// Why too few of the captures are at known places; empty when as many are as there are, or as are
/// wanted.
std::string places_problem(std::size_t known, std::size_t captures, int wanted);

}  // namespace vlp
