// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/inverse_height.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/median.h"

namespace vlp {

double InverseHeight::compute_radius_in_plane(double radius_m, double height_beyond_first_m) const {
  return radius_m / (std::exp(-log_value) + height_beyond_first_m);
}

std::optional<InverseHeight> estimate_inverse_height(const std::vector<LampInPlane>& lamps) {
  constexpr double min_sd = 0.015, max_sd = 0.2;
  struct Pair {
    double log_value, weight;
  };
  std::vector<Pair> pairs;
  double total = 0, largest = 0;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const LampInPlane &a = lamps[i], &b = lamps[j];
      const Eigen::Vector2d apart = a.position_in_plane - b.position_in_plane;
      const Eigen::Vector2d rise_m = a.height_beyond_first_m * a.position_in_plane -
                                     b.height_beyond_first_m * b.position_in_plane;
      // |apart h + rise_m| is the distance in the map: a quadratic equation of h.
      const double half = apart.dot(rise_m), square = apart.squaredNorm();
      const double distance_m = (a.position_m - b.position_m).norm();
      const double excess = rise_m.squaredNorm() - distance_m * distance_m;
      const double height_m = (std::sqrt(half * half - square * excess) - half) / square;
      const double weight = distance_m / std::hypot(a.center_sd_m, b.center_sd_m);
      if (!(height_m > 0) || !std::isfinite(height_m)) continue;
      pairs.push_back({-std::log(height_m), weight});
      total += weight;
      largest = std::max(largest, weight);
    }
  }
  if (pairs.empty() || largest * max_sd < 1) return std::nullopt;
  std::ranges::sort(pairs, {}, &Pair::log_value);
  double sum = 0;
  const auto middle = std::ranges::find_if(
      pairs, [&](const Pair& pair) { return (sum += pair.weight) >= total / 2; });
  return InverseHeight{middle->log_value, std::max(min_sd, 1 / largest)};
}

std::optional<InverseHeight> fit_inverse_height(const std::vector<LampRadius>& radii) {
  constexpr std::size_t min_lamps = 3;
  constexpr double min_sd = 0.005, sd_per_median_deviation = 1.4826;
  std::vector<double> log_values;
  for (const LampRadius& lamp : radii) {
    const double height_m = lamp.radius_m / lamp.radius_in_plane - lamp.height_beyond_first_m;
    if (height_m > 0) log_values.push_back(-std::log(height_m));
  }
  if (log_values.size() < min_lamps) return std::nullopt;
  const double median = upper_median(log_values);
  for (double& value : log_values) value = std::abs(value - median);
  const double deviation = upper_median(std::move(log_values));
  return InverseHeight{median, std::max(min_sd, sd_per_median_deviation * deviation)};
}

}  // namespace vlp
