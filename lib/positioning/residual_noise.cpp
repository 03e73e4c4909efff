// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/residual_noise.h"

#include <algorithm>
#include <cmath>

#include "rig/detection.h"

namespace vlp {

ResidualSums sum_residuals(std::span<const Fix> fixes) {
  ResidualSums sums;
  for (const Fix& fix : fixes) {
    if (!fix.ok() || !(fix.redundancy > 0)) continue;
    sums.squares_px2 += fix.sightings * fix.residual_px * fix.residual_px;
    sums.chi_squared += fix.chi_squared;
    sums.common_chi_squared += fix.common_chi_squared;
    sums.degrees_of_freedom += fix.redundancy;
  }
  return sums;
}

std::optional<double> residual_noise_px(const ResidualSums& sums) {
  if (!(sums.degrees_of_freedom > 0)) return std::nullopt;
  return std::clamp(std::sqrt(sums.squares_px2 / sums.degrees_of_freedom), kMinSigma_px,
                    kMaxSigma_px);
}

std::optional<double> estimate_noise_factor(const ResidualSums& sums) {
  if (!(sums.degrees_of_freedom > 0)) return std::nullopt;
  return std::sqrt(std::max(0.0, sums.chi_squared - sums.common_chi_squared) /
                   sums.degrees_of_freedom);
}

double noise_understatement(const ResidualSums& sums) {
  constexpr double min_degrees_of_freedom = 12;
  if (sums.degrees_of_freedom < min_degrees_of_freedom) return 1;
  const double own = sums.chi_squared - 2 * sums.common_chi_squared;
  return std::sqrt(std::max(1.0, own / sums.degrees_of_freedom));
}

}  // namespace vlp
