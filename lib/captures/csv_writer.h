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

/// A CSV file in the making: rows go in and, a few at a time, on to the disk; with save() the file
/// is there, whole. Fields are quoted where they must be. Text that a spreadsheet would calculate
/// gets an apostrophe first (csv_formula.h). Each throws InputError when the file cannot be
/// written.
class CsvWriter {
 public:
  CsvWriter(const std::filesystem::path& file, std::initializer_list<std::string_view> header)
      : file_(file) {
    row(header);
  }
  /// With as many columns as the header has.
  CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& header)
      : file_(file) {
    row(header);
  }

  void row(std::initializer_list<std::string_view> fields);
  void row(const std::vector<std::string>& fields);
  void save();
  /// See WholeFile.
  void save_unsynced();

 private:
  void write_waiting();
  void write_row(std::span<const std::string_view> fields);

  WholeFile file_;
  std::string waiting_;
};

}  // namespace vlp
