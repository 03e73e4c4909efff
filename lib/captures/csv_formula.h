// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace vlp {

/// Returns true for a field that a spreadsheet would calculate: it begins with =, +, -, @, a
/// tabulator or a carriage return, and more follows. Apostrophes before these count as part of it,
/// so that the one that CsvWriter puts before such a field can be taken away again by CsvTable.
/// Numbers with a sign begin so, too, and are left to the caller.
/// Source: OWASP, "CSV Injection".
constexpr bool begins_like_formula(std::string_view field) {
  const auto first = field.find_first_not_of('\'');
  if (first == std::string_view::npos || first + 1 == field.size()) return false;
  return std::string_view("=+-@\t\r").find(field[first]) != std::string_view::npos;
}

}  // namespace vlp
