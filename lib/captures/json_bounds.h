// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace vlp {

/// Checks before a JSON text of others is parsed that it has at most 16 levels and a million
/// values: a parser takes a hundred bytes for a value that is two in the text. Values in strings do
/// not count. Throws std::runtime_error, which says which bound is exceeded.
void check_json_bounds(std::string_view text);

}  // namespace vlp
