// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace vlp {

/// A text for a terminal or a log, in which names of files and of others stand: control characters,
/// those of ISO 6429 beyond ASCII too, and what is no UTF-8 become \xNN a byte. Lines and
/// tabulators stay.
std::string printable(std::string_view text);

/// The first characters of a text in UTF-8: so many bytes at most, no character cut.
std::string first_characters(std::string text, std::size_t most_bytes);

}  // namespace vlp
