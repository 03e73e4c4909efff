// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "fix.h"

namespace vlp {

/// Residuals of many fixes, summed over those that have redundancy. Fixes with a reduced
/// chi-squared above 25 times the median are left out.
struct ResidualSums {
  /// Squared residuals, in px^2 and over their variances.
  double squares_px2 = 0, chi_squared = 0;
  /// Expected contribution of the errors of calibration and lamp map to chi_squared.
  double common_chi_squared = 0;
  double degrees_of_freedom = 0;
};

ResidualSums sum_residuals(std::span<const Fix> fixes);

/// Returns the standard deviation of a pixel per axis that the residuals show:
///   sqrt(sum of squared residuals / degrees of freedom).
/// Errors of calibration and lamp map count as noise. Within kMinSigma_px and kMaxSigma_px, or
/// std::nullopt without redundancy.
std::optional<double> estimate_noise_px(const ResidualSums& sums);

/// Estimates the factor by which the noise of the pixels differs from what the fixes were computed
/// with. Errors that are stated do not count as noise:
///   factor^2 = (chi_squared - common_chi_squared) / degrees of freedom,
/// at least a quarter of chi_squared / degrees of freedom: all fixes share one realization of the
/// errors of calibration and map, which may be far from its expectation.
/// std::nullopt without redundancy.
/// @pre the fixes were computed with PositionerOptions::computes_common_chi_squared
std::optional<double> estimate_noise_factor(const ResidualSums& sums);

/// Returns the factor by which stated noise is too small according to the residuals, 1 if it is not
/// (Birge ratio; Birge 1932, Phys. Rev. 40, 207). Twice the expectation of the errors of
/// calibration and lamp map are attributed to them, since all fixes share one realization of these.
/// 1 with fewer than 12 degrees of freedom, which determine the factor to 20 % at best.
/// @pre the fixes were computed with PositionerOptions::computes_common_chi_squared
double estimate_birge_ratio(const ResidualSums& sums);

}  // namespace vlp
