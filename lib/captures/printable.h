// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace vlp {

/// Escapes a text with untrusted names for a terminal or a log. Control characters, including those
/// of ISO 6429 beyond ASCII, marks of direction, line separators, noncharacters and bytes that are
/// not UTF-8 become \xNN per byte. Line ends and tabulators stay.
std::string escape_for_terminal(std::string_view text);

/// Escapes a text with untrusted names for one line of a list. Replaces line ends, tabulators and
/// all that escape_for_terminal() replaces by \xNN per byte. An untrusted name therefore
/// cannot add a line.
std::string escape_for_line(std::string_view text);

/// Returns the longest prefix of a UTF-8 text with at most `max_bytes` bytes and no truncated
/// character.
std::string truncate_utf8_text(std::string text, std::size_t max_bytes);

}  // namespace vlp
