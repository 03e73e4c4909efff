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
  /// Sum of the squared residuals of the pixels over both axes, px^2.
  double squares_px2 = 0;
  double degrees_of_freedom = 0;
};

/// Sums the residuals of fixes. Ignores fixes without redundancy, and those whose reduced
/// chi-squared exceeds 25 times the median.
ResidualSums sum_fix_residuals(std::span<const Fix> fixes);

/// Estimates the standard deviation of a pixel per axis from the residuals:
///   sqrt(sum of squared residuals / degrees of freedom)
/// Errors of calibration and lamp map count as noise. Clamped to [kMinSigma_px, kMaxSigma_px].
/// Returns std::nullopt without redundancy.
std::optional<double> estimate_noise_px(const ResidualSums& sums);

/// Returns the 1e-4 bound of chi-squared; that of one degree of freedom for fewer.
double compute_chi_squared_limit(double degrees_of_freedom);

/// Estimates the factor by which the noise of one fix is too small if its residuals contradict the
/// noise: if chi-squared exceeds its 1e-4 bound. Otherwise returns 1 (Birge ratio; Birge 1932,
/// Phys. Rev. 40, 207). Twice the expectation of the errors of calibration and lamp map is
/// attributed to them, since fixes share one realization of these.
double compute_birge_ratio(const Fix& fix);

}  // namespace vlp
