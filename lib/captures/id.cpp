// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/id.h"

#include <utility>

#include "captures/printable.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// 255 bytes of a file name, minus the run, event and ending that follow an id.
constexpr std::size_t kMaxBytes = 200;

}  // namespace

bool Id::is_valid(std::string_view text) {
  return !text.empty() && text.size() <= kMaxBytes && text.front() != '.' &&
         text.find('/') == std::string_view::npos && escape_for_line(text) == text;
}

Id::Id(std::string text, const std::filesystem::path& source, std::string_view kind)
    : text_(std::move(text)) {
  if (is_valid(text_)) return;
  constexpr std::size_t max_shown = 100;
  std::string problem = truncate_utf8_text(escape_for_line(text_), max_shown);
  throw InputError(source, problem.insert(0, "'").append("' is no id of a ").append(kind) +
                               ": 1 to 200 bytes of UTF-8 are one, without '/', without "
                               "control characters, and without a '.' at the beginning");
}

}  // namespace vlp
