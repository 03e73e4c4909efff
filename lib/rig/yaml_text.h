// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>
#include <string_view>

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Returns the shortest decimal text that parses to the same double. Text with an exponent has a
/// point, too ("1.0e-07"): without a point, YAML 1.1 readers such as PyYAML parse it as text.
std::string format_exact_number(double value);

/// Shortens a text for a message. A text of more than `max_bytes` bytes is cut after the last
/// complete UTF-8 character within them, and "..." is appended. Other texts are returned unchanged.
std::string truncate_text(std::string_view text, std::size_t max_bytes);
/// Returns a text in quotes for a message, cut by truncate_text() to 40 bytes.
std::string quote_for_message(std::string_view text);

/// Returns the line of a mark, from 1; 0 if unknown.
std::size_t line_of_mark(const YAML::Mark& mark);

/// Returns the length in bytes of the first character of `text`; 0 if it is not UTF-8 (RFC 3629).
/// @pre `text` is not empty
std::size_t count_utf8_character(std::string_view text);
/// Returns the length in bytes of the longest prefix of `text` that is UTF-8.
std::size_t count_utf8_prefix(std::string_view text);

}  // namespace vlp
#pragma GCC visibility pop
