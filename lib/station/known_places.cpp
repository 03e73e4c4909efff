// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/known_places.h"

#include <fmt/core.h>

#include <algorithm>

namespace vlp {

CapturesTable places_in(const std::filesystem::path& folder) {
  CapturesTable places;
  for (const char* table : {"captures.csv", "truth.csv"}) {
    if (!places.empty() || !std::filesystem::exists(folder / table)) continue;
    places = read_captures(folder / table);
    std::erase_if(places, [](const auto& place) { return !place.second.x_m; });
  }
  return places;
}

std::string places_problem(std::size_t known, std::size_t captures, int wanted) {
  if (known > 0 && known >= std::min(captures, static_cast<std::size_t>(wanted))) return "";
  return fmt::format(
      "nothing tells where {} of the {} captures are: captures.csv or truth.csv of the step "
      "should, "
      "with x_m and y_m of each",
      captures - known, captures);
}

}  // namespace vlp
