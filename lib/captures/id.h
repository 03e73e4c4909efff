// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// Name of a camera, run, session or step, checked when it is constructed. It is one component of a
/// path and reads the same in a table, a report and a terminal: 1 to 200 bytes of UTF-8, without
/// '/', control characters, marks of direction, and '.' as its first character.
class Id {
 public:
  /// Checks a text and stores it as an id.
  /// @param source  file or database from which the text was read, for the message
  /// @param kind    type of the named object for the message: "camera", "run", ...
  /// @throws InputError if the text is not an id (is_valid())
  Id(std::string text, const std::filesystem::path& source, std::string_view kind);

  /// Returns true if a text is an id.
  static bool is_valid(std::string_view text);

  const std::string& id_text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace vlp
