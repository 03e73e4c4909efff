// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/printable.h"

#include <cstddef>

#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// Returns true for line separators and marks that change the direction of the text around
/// them (Unicode Standard Annex 9, section 2): U+061C, U+200E, U+200F, U+2028 to U+202E, U+2066 to
/// U+2069.
bool is_direction_mark(std::string_view character) {
  if (character == "\u061c") return true;
  if (character.size() != 3) return false;
  const auto is_within = [&](const char* low, const char* high) {
    return character >= low && character <= high;
  };
  return is_within("\u200e", "\u200f") || is_within("\u2028", "\u202e") ||
         is_within("\u2066", "\u2069");
}

/// Returns true for noncharacters, such as U+FFFE (The Unicode Standard, section 23.7): readers of
/// YAML replace or reject them.
bool is_noncharacter(std::string_view character) {
  if (character.size() == 3 && character >= "\ufdd0" && character <= "\ufdef") return true;
  if (!character.ends_with("\xbf\xbe") && !character.ends_with("\xbf\xbf")) return false;
  const auto before = static_cast<unsigned char>(character[character.size() - 3]);
  return character.size() == 3 ? before == 0xef : character.size() == 4 && (before & 0x0f) == 0x0f;
}

bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (first == 0xc2) return static_cast<unsigned char>(character[1]) < 0xa0;
  return first < 0x20 || first == 0x7f || is_direction_mark(character) ||
         is_noncharacter(character);
}

/// Escapes control characters and invalid bytes, except characters in `kept`.
std::string escape_characters(std::string_view text, std::string_view kept) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string result;
  while (!text.empty()) {
    const std::size_t length = count_utf8_character(text);
    const std::string_view character = text.substr(0, length);
    if (length > 0 && (!is_control(character) || kept.find(character) != kept.npos)) {
      result += character;
      text.remove_prefix(length);
      continue;
    }
    for (std::size_t i = 0; i < (length > 0 ? length : 1); ++i) {
      const auto byte = static_cast<unsigned char>(text[i]);
      result += {'\\', 'x', digits[byte / 16], digits[byte % 16]};
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return result;
}

}  // namespace

std::string escape_for_terminal(std::string_view text) { return escape_characters(text, "\n\t"); }

std::string escape_for_line(std::string_view text) { return escape_characters(text, ""); }

std::string truncate_utf8_text(std::string text, std::size_t max_bytes) {
  const auto goes_on = [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; };
  if (text.size() <= max_bytes) return text;
  while (max_bytes > 0 && goes_on(text[max_bytes])) --max_bytes;
  text.resize(max_bytes);
  return text;
}

}  // namespace vlp
