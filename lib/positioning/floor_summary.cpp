// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/floor_summary.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "geometry/median.h"

namespace vlp {
namespace {

struct MedianAndWorst {
  double median, worst;
};

/// Precondition: not empty.
MedianAndWorst summary_of(const std::vector<double>& values) {
  return {lower_median(values), *std::max_element(values.begin(), values.end())};
}

FloorSummary::Row row_of(std::string_view source, std::span<const FloorLimit> limits,
                         const std::function<Matrix4(const ErrorBudget&)>& covariance) {
  std::vector<double> horizontal_m, height_m, yaw_rad;
  for (const FloorLimit& limit : limits) {
    if (!limit.budget) continue;
    const FixSpread spread = spread_of(covariance(*limit.budget));
    horizontal_m.push_back(spread.horizontal_m);
    height_m.push_back(spread.height_m);
    yaw_rad.push_back(spread.yaw_rad);
  }
  const auto h = summary_of(horizontal_m), z = summary_of(height_m), yaw = summary_of(yaw_rad);
  return {source, {h.median, z.median, yaw.median}, {h.worst, z.worst, yaw.worst}};
}

}  // namespace

FixSpread spread_of(const Matrix4& covariance) {
  return {std::sqrt(covariance(0, 0) + covariance(1, 1)), std::sqrt(covariance(2, 2)),
          std::sqrt(covariance(3, 3))};
}

std::optional<FloorSummary> summarize(std::span<const FloorLimit> limits) {
  const auto with_fix = std::count_if(limits.begin(), limits.end(),
                                      [](const FloorLimit& limit) { return bool(limit.budget); });
  if (with_fix == 0) return std::nullopt;
  return FloorSummary{
      {row_of("noise", limits, [](const ErrorBudget& budget) { return budget.noise; }),
       row_of("centre", limits, [](const ErrorBudget& budget) { return budget.center; }),
       row_of("tilt", limits, [](const ErrorBudget& budget) { return budget.tilt; }),
       row_of("lamp map", limits, [](const ErrorBudget& budget) { return budget.lamp_map; }),
       row_of("together", limits, [](const ErrorBudget& budget) { return budget.total(); })},
      static_cast<std::size_t>(with_fix)};
}

}  // namespace vlp
