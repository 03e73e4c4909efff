// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/dispersion/dispersion.h"

/// Statistics of all fixes at a reference point. Captures without a fix are ignored.
namespace vlp {

/// Position fixes of captures at a reference point, as functions of the dispersion's offset.
class ReferencePointFixes {
 public:
  /// Position fix of one capture for a given offset.
  struct Estimate {
    /// Fix minus reference point (x, y), in the world.
    Eigen::Vector2d error_m;
    /// Covariance of the fix, m^2, from the noise of this capture alone. Errors that all captures
    /// have in common do not scatter the fixes.
    Eigen::Matrix2d covariance;
    double yaw_rad;
    /// Mean height above the camera of the detected lamps of the map.
    double height_m;
    /// Sum of the squared residuals of the lamps' pixels, over both axes.
    double squared_residuals_px2;
    /// Degrees of freedom of `squared_residuals_px2`.
    int degrees_of_freedom;
  };

  /// Uses all lamps of the captures, so that fixes are smooth functions of offset, map and
  /// calibration (remove_outlier_lamps()).
  ReferencePointFixes(std::span<const ReferencePointCapture> captures, const LampMap& map,
                      const Calibration& calibration);

  /// Returns the fix of each capture; std::nullopt for captures without a fix.
  std::vector<std::optional<Estimate>> locate_with_offset(const Eigen::Vector2d& offset_px) const;
  /// Computes the derivatives of the fixes, in m, with respect to the positions of the lamps that
  /// are detected and have an sd_m above zero. Differentiates numerically, one coordinate at a
  /// time. The result has two rows for each capture, which are zero without a fix.
  LampDerivatives differentiate_by_lamps(const Eigen::Vector2d& offset_px) const;

 private:
  std::vector<std::optional<Estimate>> locate_with_offset(const Eigen::Vector2d& offset_px,
                                                          const LampMap& map) const;

  std::span<const ReferencePointCapture> captures_;
  const LampMap& map_;
  Calibration calibration_;
};

/// Removes the detections of each capture's outlier lamps. Returns the status of the first capture
/// without a fix; `ok` if there is none.
FixStatus remove_outlier_lamps(std::vector<ReferencePointCapture>& captures, const LampMap& map,
                               const Calibration& calibration);

/// Increases sigma_px of the captures whose residuals contradict it with this offset
/// (Fix::noise_covariance), unless a lamp is an outlier. Returns true if there are any.
bool scale_contradicted_noise(std::vector<ReferencePointCapture>& captures, const LampMap& map,
                              Calibration calibration, const Eigen::Vector2d& offset_px);

/// Fix of each capture, in their order; std::nullopt for captures without a fix.
using OptionalFixes = std::vector<std::optional<ReferencePointFixes::Estimate>>;

/// Means over the fixes that are used.
struct MeanFix {
  /// Mean of the unit vectors (cos yaw, sin yaw); shorter than 1 if the yaws differ.
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  /// Mean height of the lamps above the camera.
  double height_m = 0;
  /// Number of fixes.
  int count = 0;

  /// Returns the approximate RMS sine of the yaws relative to their mean.
  double compute_yaw_variation() const;
  /// Returns true if the yaws vary by less than about 10 degrees.
  bool are_yaws_similar() const;
};

/// Computes the means over the fixes that are used.
MeanFix compute_mean_fix(const OptionalFixes& fixes, const std::vector<bool>& used);

/// Returns true if the removal of a single fix leaves one yaw. One fix alone is not sufficient to
/// separate errors of camera and world.
bool is_yaw_range_from_one_fix(const OptionalFixes& fixes, std::vector<bool> used);

/// Returns true if every fix is farther from the reference point than a camera tilted by 11 degrees
/// would be.
bool are_all_fixes_far(const OptionalFixes& fixes);

/// Degrees of freedom assigned to given noise: its standard deviation is accurate to 29 %, 1 /
/// sqrt(12).
inline constexpr double kGivenNoiseDegreesOfFreedom = 6;

/// Computes the factor of a variance, so that 1.96 standard deviations cover about 95 % of the
/// errors.
///
/// The residuals have the variance s^2 = `ratio` times the nominal one, with nu degrees of freedom;
/// q(m) = (t_m / 1.96)^2 with a bound t_m of Student's t at 97.5 %
/// (compute_squared_t_bound). If the noise is not stated the factor is ratio q(nu). Given
/// noise counts as an estimate with n = kGivenNoiseDegreesOfFreedom:
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
std::vector<bool> flag_inlier_fixes(const OptionalFixes& fixes);

}  // namespace vlp
