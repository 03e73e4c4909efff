// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/bias_and_scatter.h"

#include <algorithm>
#include <cmath>

namespace vlp {
namespace {

struct Sums {
  std::size_t fixes = 0;
  std::size_t first_truth = 0;
  Eigen::Vector2d errors_m{0, 0};
  double squared_deviations_m2 = 0;
};

}  // namespace

std::optional<BiasAndScatter> compute_bias_and_scatter(const std::vector<FixError>& errors,
                                                       const std::vector<TruthRow>& truth) {
  std::vector<Sums> sums;
  for (const FixError& error : errors) {
    if (error.cluster >= sums.size()) sums.resize(error.cluster + 1);
    Sums& station = sums[error.cluster];
    station.first_truth =
        station.fixes == 0 ? error.truth : std::min(station.first_truth, error.truth);
    ++station.fixes;
    station.errors_m += error.horizontal_m;
  }
  for (const FixError& error : errors) {
    Sums& station = sums[error.cluster];
    const Eigen::Vector2d bias_m = station.errors_m / static_cast<double>(station.fixes);
    station.squared_deviations_m2 += (error.horizontal_m - bias_m).squaredNorm();
  }
  BiasAndScatter statistics{{}, 0, 0, 0};
  double squared_deviations_m2 = 0, squared_biases_m2 = 0;
  for (const Sums& station : sums) {
    if (station.fixes < 2) continue;
    const auto fixes = static_cast<double>(station.fixes);
    const Eigen::Vector2d bias_m = station.errors_m / fixes;
    statistics.stations.push_back({truth[station.first_truth].xy_m, station.fixes, bias_m,
                                   std::sqrt(station.squared_deviations_m2 / (fixes - 1))});
    statistics.fixes += station.fixes;
    squared_deviations_m2 += station.squared_deviations_m2;
    squared_biases_m2 += fixes * bias_m.squaredNorm();
  }
  if (statistics.stations.empty()) return std::nullopt;
  const auto stations = static_cast<double>(statistics.stations.size());
  const auto fixes = static_cast<double>(statistics.fixes);
  const double scatter_m2 = squared_deviations_m2 / (fixes - stations);
  statistics.scatter_m = std::sqrt(scatter_m2);
  statistics.bias_m = std::sqrt(std::max(0.0, squared_biases_m2 - stations * scatter_m2) / fixes);
  return statistics;
}

}  // namespace vlp
