// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "evaluation/errors/error_figures.h"

#include <algorithm>
#include <cmath>

namespace vlp {
namespace {

/// Returns the index of a quantile in `count` sorted values.
std::size_t quantile_index(double fraction, std::size_t count) {
  constexpr double numeric_tolerance = 1e-9;  // 0.07 x 100 is more than 7
  const double below = std::ceil(fraction * static_cast<double>(count) - numeric_tolerance);
  return static_cast<std::size_t>(std::max(below, 1.0)) - 1;
}

double select_nth_smallest(std::vector<double>& values, std::size_t rank) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Sums {
  std::size_t fixes = 0;
  std::size_t first_truth = 0;
  Eigen::Vector2d errors_m{0, 0};
  double squared_deviations_m2 = 0;
};

}  // namespace

double get_quantile(std::span<const double> sorted, double fraction) {
  return sorted[quantile_index(fraction, sorted.size())];
}

ErrorStatistics summarize_errors(std::vector<double> errors) {
  ErrorStatistics statistics{errors.size(), 0, 0, 0, 0, 0};
  double squares = 0;
  for (const double error : errors) {
    statistics.mean += error;
    squares += error * error;
    statistics.max = std::max(statistics.max, error);
  }
  const auto count = static_cast<double>(errors.size());
  statistics.mean /= count;
  statistics.rms = std::sqrt(squares / count);
  statistics.median = select_nth_smallest(errors, quantile_index(0.5, errors.size()));
  statistics.p90 = select_nth_smallest(errors, quantile_index(0.9, errors.size()));
  return statistics;
}

SignedErrorStatistics summarize_signed_errors(std::vector<double> errors) {
  double sum = 0;
  for (double& error : errors) {
    sum += error;
    error = std::abs(error);
  }
  const double bias = sum / static_cast<double>(errors.size());
  return {bias, summarize_errors(std::move(errors))};
}

std::vector<std::pair<double, double>> list_percentiles(std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  std::vector<std::pair<double, double>> points;
  points.reserve(100);
  for (int percent = 1; percent <= 100; ++percent) {
    points.emplace_back(percent / 100.0, get_quantile(errors, percent / 100.0));
  }
  return points;
}

std::optional<BiasAndRepeatability> compute_bias_and_repeatability(
    const std::vector<FixError>& errors, const std::vector<TruthRow>& truth) {
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
  BiasAndRepeatability statistics{{}, 0, 0, 0};
  double squared_deviations_m2 = 0, squared_biases_m2 = 0;
  for (const Sums& station : sums) {
    if (station.fixes < 2) continue;
    const auto fixes = static_cast<double>(station.fixes);
    const Eigen::Vector2d bias_m = station.errors_m / fixes;
    statistics.reference_points.push_back({truth[station.first_truth].xy_m, station.fixes, bias_m,
                                           std::sqrt(station.squared_deviations_m2 / (fixes - 1))});
    statistics.fixes += station.fixes;
    squared_deviations_m2 += station.squared_deviations_m2;
    squared_biases_m2 += fixes * bias_m.squaredNorm();
  }
  if (statistics.reference_points.empty()) return std::nullopt;
  const auto stations = static_cast<double>(statistics.reference_points.size());
  const auto fixes = static_cast<double>(statistics.fixes);
  const double scatter_m2 = squared_deviations_m2 / (fixes - stations);
  statistics.repeatability_m = std::sqrt(scatter_m2);
  statistics.bias_m = std::sqrt(std::max(0.0, squared_biases_m2 - stations * scatter_m2) / fixes);
  return statistics;
}

}  // namespace vlp
