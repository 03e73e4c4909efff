// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/round_numbers.h"

#include <cmath>

#include "captures/number_text.h"

namespace vlp {

double round_below(double value) {
  const double power = std::pow(10, std::floor(std::log10(value) + 1e-9));
  for (const double digit : {5, 2}) {
    if (digit * power <= value * (1 + 1e-9)) return digit * power;
  }
  return power;
}

std::vector<double> round_numbers(double lowest, double highest) {
  std::vector<double> numbers{round_below(lowest)};
  while (numbers.back() < highest * (1 - 1e-9)) {
    numbers.push_back(round_below(numbers.back() * 2.5));
  }
  if (numbers.size() == 1) numbers.push_back(round_below(numbers.back() * 2.5));
  return numbers;
}

std::string readable(double value, int digits) {
  return std::abs(value) >= std::pow(10, digits) ? fixed(value, 0) : significant(value, digits);
}

std::string format_mm(double length_m) { return readable(1e3 * length_m, 3); }

std::string format_mm_with_unit(double length_m) { return significant(1e3 * length_m, 3) + " mm"; }

}  // namespace vlp
