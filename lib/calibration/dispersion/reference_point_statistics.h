// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/dispersion/reference_point_fixes.h"

/// Statistics of all fixes at a reference point. Captures without a fix are ignored.
namespace vlp {

/// Fix of each capture.
using OptionalFixes = std::vector<std::optional<ReferencePointFixes::Estimate>>;

/// Means over the fixes that are used.
struct MeanFix {
  /// Mean of the unit vectors along the yaws.
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  /// Mean height of the lamps above the camera.
  double height_m = 0;
  /// Number of fixes.
  int count = 0;

  /// Returns the approximate RMS sine of the yaws relative to their mean.
  double yaw_variation() const;
  /// Returns true if the yaws vary by less than about 10 degrees.
  bool is_at_one_yaw() const;
};

/// Computes the means over the fixes that are used.
MeanFix compute_mean_fix(const OptionalFixes& fixes, const std::vector<bool>& used);

/// Returns true if the removal of a single fix leaves one yaw. One fix alone is not sufficient to
/// separate errors of camera and world.
bool is_at_one_yaw_without_one(const OptionalFixes& fixes, std::vector<bool> used);

/// Returns true if every fix is farther from the reference point than a camera tilted by 11 degrees
/// would be.
bool are_all_fixes_far(const OptionalFixes& fixes);

/// Degrees of freedom assigned to given noise: its standard deviation is accurate to 29 %, 1 /
/// sqrt(12).
inline constexpr double kStatedFreedom = 6;

/// Computes the factor of a variance, so that 1.96 standard deviations cover about 95 % of the
/// errors.
///
/// The residuals have the variance s^2 = `ratio` times the nominal one, with nu degrees of freedom;
/// q(m) = (t_m / 1.96)^2 with a bound t_m of Student's t at 97.5 % (compute_t_squared_bound). If
/// the noise is not stated the factor is ratio q(nu). Given noise counts as an estimate with n =
/// kStatedFreedom:
///   f = max(1, (n + nu ratio) / (n + nu) q(n + nu)),
/// and if the residuals contradict it, f (ratio q(nu) / f)^w where that is larger: w rises from 0
/// to 1 with chi-squared between its bounds of 20 % and 5 %, so that the factor is continuous.
/// @param pooled_ratio  ratio of all axes, which determines w; `ratio` without it
/// @pre degrees_of_freedom > 0
double compute_variance_factor(double ratio, double degrees_of_freedom, bool noise_is_stated,
                               std::optional<double> pooled_ratio = {});

/// Returns true for each fix within five standard deviations of the median fix, for fixes at one
/// yaw.
/// @pre there is at least one fix
std::vector<bool> find_near_median(const OptionalFixes& fixes);

}  // namespace vlp
