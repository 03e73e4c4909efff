// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/residual_noise.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "geometry/statistical_bounds.h"
#include "rig/detection.h"

namespace vlp {

namespace {

bool has_redundancy(const Fix& fix) { return fix.has_succeeded() && fix.redundancy > 0; }

/// Returns the median of chi_squared over its degrees of freedom.
double compute_median_chi_squared(std::span<const Fix> fixes) {
  std::vector<double> ratios;
  for (const Fix& fix : fixes) {
    if (has_redundancy(fix)) ratios.push_back(fix.chi_squared / fix.redundancy);
  }
  if (ratios.empty()) return 0;
  const auto middle = ratios.begin() + std::ssize(ratios) / 2;
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

}  // namespace

ResidualSums sum_fix_residuals(std::span<const Fix> fixes) {
  // Five standard deviations of the others: no fix of normal noise, but one with a wrong lamp.
  constexpr double max_ratio = 25;
  const double max_reduced = max_ratio * compute_median_chi_squared(fixes);
  ResidualSums sums;
  for (const Fix& fix : fixes) {
    if (!has_redundancy(fix) || fix.chi_squared > max_reduced * fix.redundancy) continue;
    sums.squares_px2 += fix.sightings * fix.residual_px * fix.residual_px;
    sums.degrees_of_freedom += fix.redundancy;
  }
  return sums;
}

std::optional<double> estimate_noise_px(const ResidualSums& sums) {
  if (!(sums.degrees_of_freedom > 0)) return std::nullopt;
  return std::clamp(std::sqrt(sums.squares_px2 / sums.degrees_of_freedom), kMinSigma_px,
                    kMaxSigma_px);
}

double compute_chi_squared_limit(double degrees_of_freedom) {
  return compute_chi_squared_bound(kSigmasOfOneInTenThousand, std::max(1.0, degrees_of_freedom));
}

double compute_birge_ratio(const Fix& fix) {
  const double noise_chi_squared = fix.chi_squared - 2 * fix.common_chi_squared;
  if (noise_chi_squared <= compute_chi_squared_limit(fix.redundancy)) return 1;
  return std::sqrt(noise_chi_squared / std::max(1.0, fix.redundancy));
}

}  // namespace vlp
