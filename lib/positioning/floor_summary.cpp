// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/floor_summary.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/median.h"

namespace vlp {
namespace {

struct MedianAndWorst {
  double median, worst;
};

/// @pre `values` is not empty
MedianAndWorst compute_median_and_worst(const std::vector<double>& values) {
  return {lower_median(values), *std::max_element(values.begin(), values.end())};
}

/// Summarizes `covariance(place)` over the places that have a fix.
template <typename Covariance>
FloorSummary::Row summarize_source(const FloorLimits::Source& source, const FloorLimits& limits,
                                   const Covariance& covariance) {
  std::vector<double> horizontal_m, height_m, yaw_rad;
  double part = 0, whole = 0;
  for (const FloorLimits::Place& place : limits.places) {
    if (place.parts.empty()) continue;
    const FixSds spread = compute_fix_sds(covariance(place));
    horizontal_m.push_back(spread.horizontal_m);
    height_m.push_back(spread.height_m);
    yaw_rad.push_back(spread.yaw_rad);
    part += spread.horizontal_m * spread.horizontal_m;
    whole += place.total().topLeftCorner<2, 2>().trace();
  }
  const auto h = compute_median_and_worst(horizontal_m), z = compute_median_and_worst(height_m),
             yaw = compute_median_and_worst(yaw_rad);
  return {source, {h.median, z.median, yaw.median}, {h.worst, z.worst, yaw.worst}, part / whole};
}

}  // namespace

FixSds compute_fix_sds(const Matrix4& covariance) {
  // The rounding errors of a zero part may be negative.
  const auto root = [](double variance) { return variance < 0 ? 0 : std::sqrt(variance); };
  return {root(covariance(0, 0) + covariance(1, 1)), root(covariance(2, 2)),
          root(covariance(3, 3))};
}

const FloorSummary::Row& FloorSummary::largest() const {
  return *std::max_element(sources.begin(), sources.end(),
                           [](const Row& a, const Row& b) { return a.fraction < b.fraction; });
}

std::optional<FloorSummary> summarize(const FloorLimits& limits) {
  const auto with_fix =
      std::count_if(limits.places.begin(), limits.places.end(),
                    [](const FloorLimits::Place& place) { return !place.parts.empty(); });
  if (with_fix == 0) return std::nullopt;
  using Place = FloorLimits::Place;
  FloorSummary summary{{},
                       summarize_source({"together", "horizontal"}, limits,
                                        [](const Place& place) { return place.total(); }),
                       static_cast<std::size_t>(with_fix)};
  for (std::size_t i = 0; i < limits.sources.size(); ++i) {
    summary.sources.push_back(summarize_source(limits.sources[i], limits,
                                               [i](const Place& place) { return place.parts[i]; }));
  }
  return summary;
}

}  // namespace vlp
