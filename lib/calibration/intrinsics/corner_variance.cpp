// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_variance.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>

namespace vlp {

CornerVariance corner_variance(std::span<const CornerError> errors) {
  constexpr int rounds = 10;
  constexpr double most_sigmas = 3;
  constexpr double least_share = 1e-6;  // of the mean square: no corner weighs all
  double mean_px2 = 0;
  for (const CornerError& error : errors) {
    mean_px2 += error.square_px2 / static_cast<double>(errors.size());
  }
  CornerVariance variance{mean_px2, 0};
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const auto& [square_px2, sd_px] : errors) {
      const double expected = variance.of(sd_px);
      const Eigen::Vector2d row = Eigen::Vector2d(1, sd_px * sd_px) / expected;
      normal += row * row.transpose();
      right += row * std::min(square_px2 / expected, most_sigmas * most_sigmas);
    }
    Eigen::Vector2d both = normal.inverse() * right;
    // Of corners that are all as good only the sum is known.
    if (!both.allFinite() || both[1] < 0) both = {right[0] / normal(0, 0), 0};
    if (both[0] < 0) both = {0, right[1] / normal(1, 1)};
    variance = {std::max(both[0], least_share * mean_px2), both[1]};
  }
  return variance;
}

}  // namespace vlp
