// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "fix.h"

namespace vlp {

/// Sums over the residuals of all fixes that have redundancy. Excludes fixes with a reduced
/// chi-squared above 25 times the median.
struct ResidualSums {
  /// Sum of the squared residuals of the pixels over both axes, px^2, and sum of these squares
  /// divided by their variances.
  double squares_px2 = 0, chi_squared = 0;
  /// Expected contribution of the errors of calibration and lamp map to chi_squared.
  double common_chi_squared = 0;
  double degrees_of_freedom = 0;
};

/// Sums the residuals of fixes. Ignores fixes without redundancy, and those whose reduced
/// chi-squared exceeds 25 times the median.
ResidualSums sum_squared_residuals_of_fixes(std::span<const Fix> fixes);

/// Estimates the standard deviation of a pixel per axis from the residuals:
///   sqrt(sum of squared residuals / degrees of freedom)
/// Errors of calibration and lamp map count as noise. Clamped to [kMinSigma_px, kMaxSigma_px].
/// Returns std::nullopt without redundancy.
std::optional<double> estimate_pixel_noise_px(const ResidualSums& sums);

/// Estimates the ratio of the pixel noise to the noise with which the fixes were computed. Reported
/// errors of calibration and map do not count as noise:
///   factor^2 = (chi_squared - common_chi_squared) / degrees of freedom
/// but at least a quarter of chi_squared / degrees of freedom. Reason: all fixes share one
/// realization of the errors of calibration and map, which may be far from its expectation. Returns
/// std::nullopt without redundancy.
/// @pre the fixes were computed with PositionerOptions::computes_common_chi_squared
std::optional<double> estimate_noise_scale_factor(const ResidualSums& sums);

/// Estimates the factor by which the reported noise is too small according to the residuals, at
/// least 1 (Birge ratio; Birge 1932, Phys. Rev. 40, 207). Twice the expectation of the errors of
/// calibration and lamp map is attributed to them, since all fixes share one realization of these.
/// Returns 1 with fewer than 12 degrees of freedom, which determine the factor to 20 % at best.
/// @pre the fixes were computed with PositionerOptions::computes_common_chi_squared
double estimate_birge_ratio(const ResidualSums& sums);

/// Returns the 1e-4 bound of chi-squared; that of one degree of freedom for fewer.
double compute_chi_squared_limit(double degrees_of_freedom);

/// Estimates the factor by which the noise of one fix is too small, as estimate_birge_ratio(), if
/// its residuals contradict the noise: if chi-squared exceeds its 1e-4 bound. Otherwise returns 1.
double estimate_noise_scale_of_contradiction(const Fix& fix);

}  // namespace vlp
