// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/input_error.h"

namespace vlp {

/// No coordinate is further off: a number beyond is a slip, and its square need not be finite.
inline constexpr double kFarthest_m = 1e6;

/// A CSV file with a header line, read whole: RFC 4180 quoting, LF or CRLF, an optional UTF-8
/// byte order mark. Columns are found by name in any order; columns that nobody asks for are
/// kept out of the way. The apostrophe that CsvWriter puts before a formula is taken away. Errors
/// name file, line and column.
class CsvTable {
 public:
  /// Throws InputError when the file cannot be read, is longer than 2 GiB, is not CSV, has a
  /// column twice, or has a row with more or fewer fields than the header (a row cut short).
  explicit CsvTable(const std::filesystem::path& file);

  struct Column {
    std::size_t index;
  };
  /// Throws InputError when the column is missing.
  Column required(std::string_view name) const;
  std::optional<Column> optional(std::string_view name) const;

  std::size_t rows() const { return lines_.size(); }
  std::string_view text(std::size_t row, Column column) const;
  /// Each throws InputError for anything but a finite, or a whole, number.
  double number(std::size_t row, Column column) const;
  int integer(std::size_t row, Column column) const;
  /// number() of a coordinate in metres; throws beyond kFarthest_m, too.
  double coordinate_m(std::size_t row, Column column) const;
  /// Nothing for an empty field.
  std::optional<double> optional_number(std::size_t row, Column column) const;

  /// Where a row begins in the file, from 1.
  std::size_t line(std::size_t row) const { return lines_[row]; }

  InputError error(std::size_t row, Column column, const std::string& problem) const;

 private:
  friend struct CsvParsing;

  std::filesystem::path file_;
  std::vector<std::string> header_;
  std::string fields_;              // of all rows, one after another
  std::vector<std::size_t> ends_;   // of each field in fields_
  std::vector<std::size_t> lines_;  // where each row begins in the file
};

}  // namespace vlp
