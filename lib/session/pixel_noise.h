// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "captures/detections_table.h"
#include "positioning/positioner.h"

namespace vlp {

/// Ratio of the pixel noise to the noise with which fixes were computed, and its degrees of
/// freedom; 0 without redundancy.
struct NoiseScale {
  double factor = 1, degrees_of_freedom = 0;
};

/// Estimates the pixel noise from the residuals of fixes. The reported errors of the lamp map and
/// of the tilt, which all fixes share, are not part of it: maximum likelihood of the variance s of
/// the noise, with these errors e as normally distributed unknowns.
///   r = P (n + G e),   n ~ N(0, s),   e ~ N(0, 1)
///   s = |r - P G e(s)|^2 / (N - sum_k l_k / (l_k + s))
/// with
///   r    whitened residuals
///   P    projector that removes the directions of the states of each fix
///   G    derivatives with respect to the errors, in their standard deviations
///   N    number of residuals after P
///   l_k  eigenvalues of G'PG
/// Source: MacKay, "Bayesian Interpolation", Neural Computation 4, 415, 1992. Few residuals do not
/// separate noise from these errors: s is then at least a quarter of |r|^2 / N.
///
/// Excludes fixes with a reduced chi-squared above 25 times the median. Errors of lamps without
/// sd_m, and of the lens, count as noise.
///
/// @param frames  frame of each fix, with the standard deviations of the fixes
/// @param unstated_sigma_px  standard deviation of detections without one
NoiseScale estimate_noise_scale(std::span<const Frame> frames, std::span<const Fix> fixes,
                                const Positioner& positioner, const LampMap& lamps,
                                const Calibration& calibration, double unstated_sigma_px);

}  // namespace vlp
