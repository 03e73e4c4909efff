// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_limits.h"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>
#include <tuple>

#include "geometry/angles.h"

namespace vlp {
namespace {

/// Returns the remedy that reduces an error source.
std::string_view find_remedy(std::string_view key) {
  if (key == "motion") return "odometry, or a faster read-out";
  if (key == "lean") return "an inclination sensor, or a camera that is held level";
  if (key == "lens") return "more views of the board, or vlp-adjust, which corrects the lens";
  if (key == "zenith") return "more captures of the turn, or vlp-adjust with known places";
  if (key == "offset") return "more captures at the known place, or vlp-adjust instead";
  if (key == "lamp_map") return "a better survey, or vlp-adjust --refine-map with known places";
  return "more lamps in view, larger in the image, or the mean of several captures";
}

}  // namespace

void print_limits(const FloorSummary& summary, const FloorLimits& limits, bool is_free) {
  const auto in_view =
      std::count_if(limits.places.begin(), limits.places.end(),
                    [](const FloorLimits::Place& place) { return place.lamps > 1; });
  fmt::print("places      {}, two lamps or more in view at {}{}\n\n", limits.places.size(), in_view,
             is_free ? fmt::format(", a fix at {}", summary.places_with_fix) : "");
  fmt::print("{:11} {:>21} {:>21} {:>21}\n", "one sigma", "horizontal (mm)", "height (mm)",
             "yaw (deg)");
  fmt::print("{:11}", "source");
  for (int i = 0; i < 3; ++i) fmt::print(" {:>10} {:>10}", "median", "worst");
  fmt::print("\n");
  const auto print = [](const FloorSummary::Row& row) {
    const auto& [median, worst] = std::tie(row.median, row.worst);
    fmt::print("{:11} {:10.3f} {:10.3f} {:10.3f} {:10.3f} {:10.4f} {:10.4f}\n", row.source.name,
               1e3 * median.horizontal_m, 1e3 * worst.horizontal_m, 1e3 * median.height_m,
               1e3 * worst.height_m, deg_from_rad(median.yaw_rad), deg_from_rad(worst.yaw_rad));
  };
  for (const FloorSummary::Row& row : summary.sources) print(row);
  print(summary.together);
}

void print_advice(const FloorSummary& summary) {
  const auto& [name, key] = summary.largest().source;
  fmt::print("\nimprove     {} first, {:.0f} % of the horizontal variance: {}\n", name,
             100 * summary.largest().fraction, find_remedy(key));
}

}  // namespace vlp
