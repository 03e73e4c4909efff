// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace vlp {

/// Invalid input. what() is one line, "file:line: key: problem and remedy", which programs print.
/// A key or problem of more than 1,000 bytes, which repeats content of a file, is cut to 300.
class InputError : public std::runtime_error {
 public:
  InputError(const std::filesystem::path& file, const std::string& problem);
  /// Creates an error about a place in a file; what() is "file:line: key: problem".
  /// @param line     line in the file, from 1; 0 if unknown
  /// @param key      YAML key with its path, such as "lamps[3].position_m", or CSV column; may be
  ///     empty
  /// @param problem  problem and remedy, human-readable
  InputError(const std::filesystem::path& file, std::size_t line, const std::string& key,
             const std::string& problem);
};

}  // namespace vlp
