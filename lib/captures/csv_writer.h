// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace vlp {

/// A CSV file in the making: rows go in, save() writes the file whole or not at all. Fields are
/// quoted where they must be.
class CsvWriter {
 public:
  explicit CsvWriter(std::initializer_list<std::string_view> header) { row(header); }

  void row(std::initializer_list<std::string_view> fields);

  /// Throws InputError when the file cannot be written.
  void save(const std::filesystem::path& file) const;

 private:
  std::string content_;
};

/// A number with so many digits after the point.
std::string fixed(double value, int digits);
/// A number with so many significant digits.
std::string significant(double value, int digits);

}  // namespace vlp
