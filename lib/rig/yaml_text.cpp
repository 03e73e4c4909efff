// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_text.h"

#include <bit>
#include <charconv>
#include <cstdint>

namespace vlp {

std::size_t count_utf8_character(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80) return 1;
  const auto length = static_cast<std::size_t>(std::countl_one(first));
  if (length < 2 || length > 4 || length > text.size()) return 0;
  std::uint32_t code = first & (0x7fU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xc0) != 0x80) return 0;
    code = (code << 6) | (byte & 0x3fU);
  }
  constexpr std::uint32_t min_code[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return code < min_code[length] || code > 0x10ffff || surrogate ? 0 : length;
}

std::string format_exact_number(double value) {
  char text[32];
  std::string digits(text, std::to_chars(text, text + sizeof text, value).ptr);
  const std::size_t exponent = digits.find('e');
  if (exponent == std::string::npos || digits.find('.') != std::string::npos) return digits;
  digits.insert(exponent, ".0");
  const auto fixed = std::to_chars(text, text + digits.size(), value, std::chars_format::fixed);
  return fixed.ec == std::errc() ? std::string(text, fixed.ptr) : digits;
}

std::string truncate_text(std::string_view text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return std::string(text);
  return std::string(text.substr(0, count_utf8_prefix(text.substr(0, max_bytes)))) + "...";
}

std::string quote_for_message(std::string_view text) { return "'" + truncate_text(text, 40) + "'"; }

std::size_t line_of_mark(const YAML::Mark& mark) {
  return mark.is_null() ? 0 : static_cast<std::size_t>(mark.line) + 1;
}

std::size_t count_utf8_prefix(std::string_view text) {
  std::size_t valid = 0;
  while (valid < text.size()) {
    const std::size_t length = count_utf8_character(text.substr(valid));
    if (length == 0) break;
    valid += length;
  }
  return valid;
}

}  // namespace vlp
