// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace vlp {

/// Checks that a JSON text from an untrusted source has at most 16 levels and a million values.
/// Call it before parsing: a parser needs 100 bytes for a value of two bytes of text. Values in
/// strings do not count. Throws std::runtime_error with the bound that is exceeded.
void check_json_bounds(std::string_view text);

}  // namespace vlp
