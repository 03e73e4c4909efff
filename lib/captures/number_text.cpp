// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/number_text.h"

#include <array>
#include <charconv>

namespace vlp {
namespace {

std::string formatted(double value, std::chars_format format, int digits) {
  std::array<char, 400> text;  // fits the longest double with a few decimals
  const auto end = std::to_chars(text.begin(), text.end(), value, format, digits).ptr;
  return {text.begin(), end};
}

}  // namespace

std::string fixed(double value, int digits) {
  return formatted(value, std::chars_format::fixed, digits);
}

std::string significant(double value, int digits) {
  return formatted(value, std::chars_format::general, digits);
}

}  // namespace vlp
