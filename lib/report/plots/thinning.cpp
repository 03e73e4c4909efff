// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/thinning.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace vlp {
namespace {

/// Returns "2nd", "11th".
std::string ordinal(std::size_t number) {
  const bool teen = number / 10 % 10 == 1;
  const std::size_t last = teen ? 0 : number % 10;
  return std::to_string(number) + (last == 1 ? "st" : last == 2 ? "nd" : last == 3 ? "rd" : "th");
}

}  // namespace

std::size_t thinning_step(std::size_t count, std::size_t max_count) {
  assert(max_count > 0);
  return count <= max_count ? 1 : (count + max_count - 1) / max_count;
}

std::string thinning_note(std::size_t count, std::size_t step) {
  if (step == 1) return "";
  return "every " + ordinal(step) + " of " + std::to_string(count) + " drawn";
}

std::vector<std::size_t> select_every_nth_and_largest(std::span<const double> values,
                                                      std::size_t step, std::size_t largest) {
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
