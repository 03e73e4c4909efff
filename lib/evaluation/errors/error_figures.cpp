// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_figures.h"

#include <algorithm>
#include <cmath>

namespace vlp {
namespace {

/// Returns the index of a quantile in `count` sorted values.
std::size_t rank_of(double share, std::size_t count) {
  constexpr double rounding = 1e-9;  // 0.07 x 100 is more than 7
  const double below = std::ceil(share * static_cast<double>(count) - rounding);
  return static_cast<std::size_t>(std::max(below, 1.0)) - 1;
}

double nth(std::vector<double>& values, std::size_t rank) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

double quantile(std::span<const double> sorted, double share) {
  return sorted[rank_of(share, sorted.size())];
}

ErrorFigures figures_of(std::vector<double> errors) {
  ErrorFigures figures{errors.size(), 0, 0, 0, 0, 0};
  double squares = 0;
  for (const double error : errors) {
    figures.mean += error;
    squares += error * error;
    figures.max = std::max(figures.max, error);
  }
  const auto count = static_cast<double>(errors.size());
  figures.mean /= count;
  figures.rms = std::sqrt(squares / count);
  figures.median = nth(errors, rank_of(0.5, errors.size()));
  figures.p90 = nth(errors, rank_of(0.9, errors.size()));
  return figures;
}

SignedFigures signed_figures_of(std::vector<double> errors) {
  double sum = 0;
  for (double& error : errors) {
    sum += error;
    error = std::abs(error);
  }
  const double bias = sum / static_cast<double>(errors.size());
  return {bias, figures_of(std::move(errors))};
}

std::vector<std::pair<double, double>> distribution_of(std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  std::vector<std::pair<double, double>> points;
  points.reserve(100);
  for (int percent = 1; percent <= 100; ++percent) {
    points.emplace_back(percent / 100.0, quantile(errors, percent / 100.0));
  }
  return points;
}

}  // namespace vlp
