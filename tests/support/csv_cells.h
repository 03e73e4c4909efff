// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "captures/csv_reader.h"

namespace vlp {

/// Reads the number in a row and a named column of a table.
inline double read_number(const CsvTable& table, std::size_t row, const std::string& column) {
  return table.get_cell_number(row, table.require_column(column));
}

/// Reads the text in a row and a named column of a table.
inline std::string read_text(const CsvTable& table, std::size_t row, const std::string& column) {
  return std::string(table.get_cell_text(row, table.require_column(column)));
}

}  // namespace vlp
