// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace vlp {

/// Returns true if a spreadsheet would evaluate the field: it begins with =, +, -, @, a tabulator
/// or a carriage return, and has more characters. Leading apostrophes are skipped, so that CsvTable
/// can remove the one that CsvWriter inserts. Returns true for signed numbers, too; the caller
/// handles these. Source: OWASP, "CSV Injection".
constexpr bool begins_like_formula(std::string_view field) {
  const auto first = field.find_first_not_of('\'');
  if (first == std::string_view::npos || first + 1 == field.size()) return false;
  return std::string_view("=+-@\t\r").find(field[first]) != std::string_view::npos;
}

}  // namespace vlp
