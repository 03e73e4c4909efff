// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/file.h"

namespace vlp {

/// Returns true if a spreadsheet would evaluate the field: it begins with =, +, -, @, a tabulator
/// or a carriage return, and has more characters. Leading apostrophes are skipped, so that CsvTable
/// can remove the one that CsvWriter inserts. Returns true for signed numbers, too; the caller
/// handles these. Source: OWASP, "CSV Injection".
constexpr bool is_like_formula(std::string_view field) {
  const auto first = field.find_first_not_of('\'');
  if (first == std::string_view::npos || first + 1 == field.size()) return false;
  return std::string_view("=+-@\t\r").find(field[first]) != std::string_view::npos;
}

/// Writer of a CSV file. Rows are buffered and written to a temporary file; save_file() renames it
/// atomically to the given path. Fields are quoted if necessary. Text that a spreadsheet would
/// evaluate gets a leading apostrophe (is_like_formula()). All functions throw
/// InputError if the file cannot be written.
class CsvWriter {
 public:
  CsvWriter(const std::filesystem::path& file, std::initializer_list<std::string_view> header)
      : file_(file) {
    write_csv_row(header);
  }
  CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& header)
      : file_(file) {
    write_csv_row(header);
  }

  /// Writes a row with as many fields as the header has.
  void write_csv_row(std::initializer_list<std::string_view> fields);
  void write_csv_row(const std::vector<std::string>& fields);
  void save_file();
  /// Saves the file without waiting for the disk (AtomicFileWriter::save_without_fsync()).
  void save_without_fsync();

 private:
  void flush_csv_buffer();
  void write_csv_fields(std::span<const std::string_view> fields);

  AtomicFileWriter file_;
  std::string buffer_;
};

}  // namespace vlp
