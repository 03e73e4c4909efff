// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/json_bounds.h"

#include <cstddef>
#include <stdexcept>

namespace vlp {

void check_json_bounds(std::string_view text) {
  constexpr std::size_t max_levels = 16, max_values = 1'000'000;
  std::size_t levels = 0, values = 0;
  bool is_in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_string) {
      if (c == '\\') ++i;
      if (c == '"') is_in_string = false;
      continue;
    }
    if (c == '"') is_in_string = true;
    if (c == '[' || c == '{') ++levels;
    if ((c == ']' || c == '}') && levels > 0) --levels;
    if (c == '[' || c == '{' || c == ',') ++values;
    if (levels > max_levels) throw std::runtime_error("it has more than 16 levels");
    if (values > max_values) throw std::runtime_error("it has more than a million values");
  }
}

}  // namespace vlp
