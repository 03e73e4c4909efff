// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>
#include <string_view>

// Not installed: nothing for the shared library to show.
#pragma GCC visibility push(hidden)
namespace vlp {

/// The fewest digits that read back as the same double. With an exponent it has a point, too
/// ("1.0e-07"): without one, YAML 1.1 readers such as PyYAML take it for text.
std::string shortest(double value);

/// Text for a message, its end left out when it is long.
std::string shortened(std::string_view text, std::size_t enough);
std::string in_quotes(std::string_view text);

/// Counted from 1; 0 when it is not known.
std::size_t line_of(const YAML::Mark& mark);

/// The length of the longest beginning of `text` that is UTF-8.
std::size_t utf8_length(std::string_view text);

}  // namespace vlp
#pragma GCC visibility pop
