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

constexpr double kMostSigmas = 3;

/// Returns the median of a property of the corners, or its mean if the median is 0.
template <typename Figure>
double usual(std::span<const CornerError> errors, const Figure& figure) {
  std::vector<double> values;
  double sum = 0;
  for (const CornerError& error : errors) {
    values.push_back(figure(error));
    sum += values.back();
  }
  const double median = upper_median(values);
  return median > 0 ? median : sum / static_cast<double>(errors.size());
}

}  // namespace

CornerVariance corner_variance(std::span<const CornerError> errors) {
  constexpr int rounds = 10;
  constexpr double least_share = 0.002;  // of the mean square: no corner dominates
  // Starts with half of the variance from pixel noise. Started with the floor alone, one corner
  // with a large deviation by chance would reduce the scale to 0.
  const double usual_px2 = usual(errors, [](const auto& error) { return error.square_px2; });
  const double usual_sd_px = usual(errors, [](const auto& error) { return error.sd_px; });
  CornerVariance variance{usual_px2 / 2, 0};
  if (usual_sd_px > 0) variance.scale2 = usual_px2 / 2 / (usual_sd_px * usual_sd_px);
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double told_px2 = 0;
    for (const auto& [square_px2, sd_px] : errors) {
      const double expected = variance.of(sd_px);
      const Eigen::Vector2d row = Eigen::Vector2d(1, sd_px * sd_px) / expected;
      normal += row * row.transpose();
      const double square = std::min(square_px2 / expected, kMostSigmas * kMostSigmas);
      right += row * square;
      told_px2 += square * expected / static_cast<double>(errors.size());
    }
    Eigen::Vector2d both = normal.inverse() * right;
    // With equal deviations only the sum of the components is determined.
    if (!both.allFinite() || both[1] < 0) both = {right[0] / normal(0, 0), 0};
    if (both[0] < 0) both = {0, right[1] / normal(1, 1)};
    variance = {std::max(both[0], least_share * told_px2), both[1]};
  }
  return variance;
}

CornerWeights::CornerWeights(std::span<const CornerError> told, std::span<const CornerError> untold)
    : variance_(corner_variance(told)), mean_px2_(0) {
  for (const auto& [square_px2, sd_px] : told) {
    mean_px2_ += std::min(square_px2, kMostSigmas * kMostSigmas * variance_.of(sd_px)) /
                 static_cast<double>(told.size());
  }
  untold_px2_ = mean_px2_;
  if (std::ranges::any_of(untold, [](const auto& error) { return error.square_px2 > 0; })) {
    untold_px2_ = std::max(mean_px2_, corner_variance(untold).of(0));
  }
}

double CornerWeights::of(double sd_px) const {
  return std::sqrt(mean_px2_ / (sd_px > 0 ? variance_.of(sd_px) : untold_px2_));
}

}  // namespace vlp
