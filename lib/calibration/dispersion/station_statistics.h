// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/dispersion/station_fixes.h"

/// What the fixes at a station are like as a whole. Captures without a fix count for nothing.
namespace vlp {

/// Of each capture.
using OptionalFixes = std::vector<std::optional<StationFixes::At>>;

/// Means over the fixes that are used.
struct TypicalFix {
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  double height_m = 0;
  int count = 0;

  /// Root of the mean squared sine, about, of the yaws from their mean.
  double yaw_variety() const;
  bool at_one_yaw() const;
};

TypicalFix typical_of(const OptionalFixes& fixes, const std::vector<bool>& used);

/// Whether one yaw is left when some single fix is left out: one alone is not to tell camera from
/// world.
bool at_one_yaw_without_one(const OptionalFixes& fixes, std::vector<bool> used);

/// Whether every fix is farther from the station than a camera that leans by 11 degrees would be.
bool far_from_all(const OptionalFixes& fixes);

/// Degrees of freedom with which stated noise counts: its standard deviation is right to 29 %,
/// 1 / sqrt(12).
inline constexpr double kStatedFreedom = 6;

/// Computes the factor of a variance, so that 1.96 standard deviations cover about 95 % of the
/// errors.
///
/// The residuals have the variance s^2 = `ratio` times the nominal one, with nu degrees of freedom;
/// q(m) = (t_m / 1.96)^2 with a bound t_m of Student's t at 97.5 % (student_bound). If the noise is
/// not stated the factor is ratio q(nu). Stated noise counts as an estimate with
/// n = kStatedFreedom:
///   f = max(1, (n + nu ratio) / (n + nu) q(n + nu)),
/// and if the residuals contradict it, f (ratio q(nu) / f)^w where that is larger: w rises from 0
/// to 1 with chi-squared between its bounds of 20 % and 5 %, so that the factor is continuous.
/// @param pooled_ratio  ratio of all axes, which determines w; `ratio` without it
/// @pre degrees_of_freedom > 0
double compute_variance_factor(double ratio, double degrees_of_freedom, bool noise_is_stated,
                               std::optional<double> pooled_ratio = {});

/// Those within five standard deviations of the median fix, at one yaw. Precondition: there is one.
std::vector<bool> near_median(const OptionalFixes& fixes);

}  // namespace vlp
