// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace vlp {

/// Returns a text for a terminal or a log that holds names from others: control characters, those
/// of ISO 6429 beyond ASCII too, marks of direction, separators of lines, code points that are no
/// characters and bytes that are no UTF-8 become \xNN a byte. Line ends and tabulators stay.
std::string printable(std::string_view text);

/// Returns printable() in one line: line ends and tabulators become \xNN, too, so that a name from
/// others cannot add a line to a list.
std::string printable_line(std::string_view text);

/// The first characters of a text in UTF-8: so many bytes at most, no character cut.
std::string first_characters(std::string text, std::size_t most_bytes);

}  // namespace vlp
