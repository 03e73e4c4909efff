// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_variance.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/median.h"

namespace vlp {
namespace {

constexpr double kMaxSigmas = 3;

/// Returns the median of a property of the corners, or its mean if the median is 0.
template <typename Property>
double compute_typical_variance(std::span<const CornerError> errors, const Property& property) {
  std::vector<double> values;
  double sum = 0;
  for (const CornerError& error : errors) {
    values.push_back(property(error));
    sum += values.back();
  }
  const double median = upper_median(values);
  return median > 0 ? median : sum / static_cast<double>(errors.size());
}

}  // namespace

CornerVariance fit_corner_variance(std::span<const CornerError> errors) {
  constexpr int max_iterations = 10;
  constexpr double min_fraction = 0.002;  // of the mean square: no corner dominates
  // Starts with half of the variance from pixel noise. Started with the floor alone, one corner
  // with a large deviation by chance would reduce the scale to 0.
  const double typical_px2 =
      compute_typical_variance(errors, [](const auto& error) { return error.square_px2; });
  const double typical_sd_px =
      compute_typical_variance(errors, [](const auto& error) { return error.sd_px; });
  CornerVariance variance{typical_px2 / 2, 0};
  if (typical_sd_px > 0) variance.scale2 = typical_px2 / 2 / (typical_sd_px * typical_sd_px);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double known_px2 = 0;
    for (const auto& [square_px2, sd_px] : errors) {
      const double expected = variance.variance_px2(sd_px);
      const Eigen::Vector2d row = Eigen::Vector2d(1, sd_px * sd_px) / expected;
      normal += row * row.transpose();
      const double square = std::min(square_px2 / expected, kMaxSigmas * kMaxSigmas);
      right += row * square;
      known_px2 += square * expected / static_cast<double>(errors.size());
    }
    Eigen::Vector2d components = normal.inverse() * right;
    // With equal deviations only the sum of the components is determined.
    if (!components.allFinite() || components[1] < 0) components = {right[0] / normal(0, 0), 0};
    if (components[0] < 0) components = {0, right[1] / normal(1, 1)};
    variance = {std::max(components[0], min_fraction * known_px2), components[1]};
  }
  return variance;
}

CornerWeights::CornerWeights(std::span<const CornerError> known,
                             std::span<const CornerError> unknown)
    : variance_(fit_corner_variance(known)), mean_px2_(0) {
  for (const auto& [square_px2, sd_px] : known) {
    mean_px2_ += std::min(square_px2, kMaxSigmas * kMaxSigmas * variance_.variance_px2(sd_px)) /
                 static_cast<double>(known.size());
  }
  unknown_px2_ = mean_px2_;
  if (std::ranges::any_of(unknown, [](const auto& error) { return error.square_px2 > 0; })) {
    unknown_px2_ = std::max(mean_px2_, fit_corner_variance(unknown).variance_px2(0));
  }
}

double CornerWeights::corner_weight(double sd_px) const {
  return std::sqrt(mean_px2_ / (sd_px > 0 ? variance_.variance_px2(sd_px) : unknown_px2_));
}

}  // namespace vlp
