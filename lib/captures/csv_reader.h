// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "rig/input_error.h"

namespace vlp {

/// Maximum coordinate. Larger values are mistakes, and their squares may overflow.
inline constexpr double kMaxCoordinate_m = 1e6;

/// CSV file with a header line, read into memory. Accepts quoting by RFC 4180, LF or CRLF, and an
/// optional UTF-8 byte order mark. Columns are found by name in any order; other columns are
/// ignored. Removes the apostrophe that CsvWriter inserts before a formula. Errors have file, line
/// and column.
class CsvTable {
 public:
  /// Reads and parses a CSV file.
  /// @throws InputError if the file cannot be read, is longer than 2 GiB or is not CSV; if it has a
  ///     column twice, or a row with more or fewer fields than the header
  explicit CsvTable(const std::filesystem::path& file);

  struct Column {
    std::size_t index;
  };
  /// Returns a column. Throws InputError if a required one is missing.
  Column require_column(std::string_view name) const;
  std::optional<Column> find_column(std::string_view name) const;

  std::size_t num_rows() const { return lines_.size(); }
  std::string_view get_cell_text(std::size_t row, Column column) const;
  /// Returns a finite number, or an integer. Throws InputError for other fields.
  double get_cell_number(std::size_t row, Column column) const;
  int get_cell_integer(std::size_t row, Column column) const;
  /// Returns a coordinate in meters. Throws InputError also if it exceeds kMaxCoordinate_m.
  double get_coordinate_m(std::size_t row, Column column) const;
  /// Returns a number; std::nullopt if the column is missing or the field is empty.
  std::optional<double> get_optional_number(std::size_t row, std::optional<Column> column) const;

  /// Returns the line in the file at which a row begins, from 1.
  std::size_t line_number_of_row(std::size_t row) const { return lines_[row]; }

  InputError make_cell_error(std::size_t row, Column column, const std::string& problem) const;

 private:
  friend struct CsvParsing;

  std::filesystem::path file_;
  std::vector<std::string> header_;
  std::string fields_;              // fields of all rows, concatenated
  std::vector<std::size_t> ends_;   // end of each field in fields_
  std::vector<std::size_t> lines_;  // line in the file at which each row begins
};

/// Index of each name. It holds views: the names must outlive it.
class NameIndex {
 public:
  /// Reserves memory for `max_names` names.
  explicit NameIndex(std::size_t max_names) { indices_.reserve(max_names); }

  /// Adds a name with the next index, from 0. Returns false, without a change, if the name exists.
  bool insert_unique_name(std::string_view name) {
    return indices_.try_emplace(name, indices_.size()).second;
  }
  /// Returns the index of a name; std::nullopt if it does not exist.
  std::optional<std::size_t> find_name_index(std::string_view name) const {
    const auto found = indices_.find(name);
    return found == indices_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  std::unordered_map<std::string_view, std::size_t> indices_;
};

/// Returns the name in a cell and adds it to `names`. Throws InputError if it is empty or occurs in
/// an earlier row.
std::string_view read_unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                                  NameIndex& names);

}  // namespace vlp
