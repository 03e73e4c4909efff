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

}  // namespace vlp
