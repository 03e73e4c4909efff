// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "report/plots/plot_parts.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "captures/number_text.h"

namespace vlp {
namespace {

/// Returns "2nd", "11th".
std::string format_ordinal(std::size_t number) {
  const bool teen = number / 10 % 10 == 1;
  const std::size_t last = teen ? 0 : number % 10;
  return std::to_string(number) + (last == 1 ? "st" : last == 2 ? "nd" : last == 3 ? "rd" : "th");
}

}  // namespace

double round_down_to_1_2_5(double value) {
  const double power = std::pow(10, std::floor(std::log10(value) + 1e-9));
  for (const double digit : {5, 2}) {
    if (digit * power <= value * (1 + 1e-9)) return digit * power;
  }
  return power;
}

std::vector<double> list_1_2_5_series(double lowest, double highest) {
  std::vector<double> numbers{round_down_to_1_2_5(lowest)};
  while (numbers.back() < highest * (1 - 1e-9)) {
    numbers.push_back(round_down_to_1_2_5(numbers.back() * 2.5));
  }
  if (numbers.size() == 1) numbers.push_back(round_down_to_1_2_5(numbers.back() * 2.5));
  return numbers;
}

std::string format_number_for_humans(double value, int digits) {
  return std::abs(value) >= std::pow(10, digits) ? format_fixed_decimals(value, 0)
                                                 : format_digits(value, digits);
}

std::string format_mm(double length_m) { return format_number_for_humans(1e3 * length_m, 3); }

std::string format_with_mm(double length_m) { return format_digits(1e3 * length_m, 3) + " mm"; }

std::string quote_for_gnuplot(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "''";
    } else if (c == '\n') {
      quoted += "'.\"\\n\".'";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

std::string format_data_row(std::initializer_list<double> values) {
  std::string row;
  for (const double value : values) row.append(format_digits(value, kPlotDigits)).append(" ");
  return row + "\n";
}

std::string make_data_block(const std::string& name, const std::string& rows) {
  return "$" + name + " << END\n" + rows + "END\n";
}

std::string make_settings() {
  return "set encoding utf8\n"
         "set tics out nomirror\n"
         "set key below Left reverse height 1\n"
         "set grid linecolor rgb '#e4e4e4'\n"
         "set style textbox opaque noborder margins 0.5,0.5\n"
         "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')\n";
}

std::string make_gnuplot_title_command(const std::string& title) {
  return "set title " + quote_for_gnuplot(title) + " noenhanced\n";
}

std::string make_color_clause(const std::string& color) {
  return " linecolor rgb '" + color + "' ";
}

std::string format_gnuplot_range(double from, double to) {
  return "[" + format_digits(from, kPlotDigits) + ":" + format_digits(to, kPlotDigits) + "]";
}

std::size_t compute_thinning_step(std::size_t count, std::size_t max_count) {
  assert(max_count > 0);
  return count <= max_count ? 1 : (count + max_count - 1) / max_count;
}

std::string describe_thinning(std::size_t count, std::size_t step) {
  if (step == 1) return "";
  return "every " + format_ordinal(step) + " of " + std::to_string(count) + " drawn";
}

std::vector<std::size_t> thin_out_indices(std::span<const double> values, std::size_t step,
                                          std::size_t largest) {
  std::vector<std::size_t> all(values.size()), chosen;
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t i = 0; i < values.size(); i += step) chosen.push_back(i);
  const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min(largest, all.size()));
  std::partial_sort(all.begin(), end, all.end(), [&](std::size_t a, std::size_t b) {
    return values[a] != values[b] ? values[a] > values[b] : a < b;
  });
  chosen.insert(chosen.end(), all.begin(), end);
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

}  // namespace vlp
