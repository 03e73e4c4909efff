// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/input_error.h"

#include <algorithm>

#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// Returns a problem without a long text of a file.
std::string shorten_problem(const std::string& problem) {
  constexpr std::size_t max_bytes = 1000, shortened_bytes = 300;
  return truncate_text(problem, problem.size() > max_bytes ? shortened_bytes : max_bytes);
}

/// Returns one line without control characters.
std::string escape_control_characters(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text;
}

}  // namespace

InputError::InputError(const std::filesystem::path& file, const std::string& problem)
    : InputError(file, 0, "", problem) {}

InputError::InputError(const std::filesystem::path& file, std::size_t line, const std::string& key,
                       const std::string& problem)
    : std::runtime_error(escape_control_characters(
          file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
          (key.empty() ? "" : shorten_problem(key) + ": ") + shorten_problem(problem))) {}

}  // namespace vlp
