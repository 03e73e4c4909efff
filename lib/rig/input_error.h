// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace vlp {

/// Bad input: what() is one line "file:line: key: what is wrong and what to do". Programs catch
/// it once, in main, print the line and exit with 2.
class InputError : public std::runtime_error {
 public:
  InputError(const std::filesystem::path& file, const std::string& problem);
  /// `line` counts from 1; 0 when it is not known. `key` is the YAML key or the CSV column with
  /// its way there, such as "lamps[3].position_m"; it may be empty.
  InputError(const std::filesystem::path& file, std::size_t line, const std::string& key,
             const std::string& problem);
};

}  // namespace vlp
