// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "calibration/dispersion/reference_point_fixes.h"

namespace vlp {

/// Errors of camera and world from estimate_dispersion(), method `camera`.
struct OffsetSeparation {
  /// Offset (u, v) of the dispersion in the undistorted image, px. It rotates with the camera,
  /// unlike `world_m`.
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  /// Mean error (x, y) of the corrected fixes, fix minus reference point, in the world frame, m.
  Eigen::Vector2d world_m = Eigen::Vector2d::Zero();
  /// Covariance of (offset_px, world_m) for fixes that scatter according to their covariances and
  /// an exact map.
  Eigen::Matrix4d covariance;
  /// Derivative of (offset_px, world_m) with respect to the fixes of all captures, two columns
  /// each: zero for those that are not used.
  Eigen::Matrix4Xd jacobian_wrt_fixes = {};
  /// Variance factor: squared residuals divided by their expectation. It is 0 without redundancy.
  double variance_factor;
  /// Number of rows of the used fixes minus the number of unknowns.
  int degrees_of_freedom = 0;
  /// True for each capture whose fix is used.
  std::vector<bool> used;
};

/// Estimates offset and world error by Gauss-Newton iterations on
/// fix_k(offset) - reference - world. Differentiates the fixes numerically. Starts with Cauchy
/// weights, then uses plain least squares without outliers (kFixOutlierSigmas).
///
/// Returns std::nullopt if the captures do not determine the unknowns, or if the iterations do not
/// converge.
std::optional<OffsetSeparation> separate_offsets(const ReferencePointFixes& fixes);

/// Number of standard deviations beyond which a fix is an outlier, for a known variance
/// (compute_outlier_bound_2d()).
inline constexpr double kFixOutlierSigmas = 5;
/// Smallest variance of residuals, in m^2 or relative to their covariance. Smaller ones are numeric
/// noise.
inline constexpr double kFixRoundingVariance = 1e-24;

/// Returns the dispersion circle of the points.
/// @pre there is at least one point
Circle fit_dispersion_circle(const std::vector<Eigen::Vector2d>& points, DispersionCircle kind);

/// Result of estimate_chen_guan_offset(). Members other than `status` are valid only
/// if it is `ok`.
struct ChenGuanOffset {
  /// Status `ok`, `several_yaws` or `diverged`.
  DispersionStatus status;
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  /// Covariance from the scatter of the fixes, at least that of their noise. Absent for the
  /// enclosing circle.
  std::optional<Matrix2> covariance = {};
  /// Derivative of offset_px with respect to the fixes of all captures; empty without a covariance.
  Eigen::Matrix2Xd jacobian_wrt_fixes = {};
  /// True for each capture whose fix is used.
  std::vector<bool> used = {};
};

/// Finds the offset with which the circle of the fixes is centered at the reference point (eq. 10
/// and 11), for captures at one yaw.
///
/// @param noise_is_stated  whether all detections have a sigma_px; otherwise it is estimated from
///     the residuals of the fixes
/// @pre there is at least one fix
///
/// Starts with eq. 12 and 13 in their intended form, -f e^{-jg} D / H. This is exact if the offset
/// is applied as a shift and all lamps have one height. After a rotation center of model `tilt` the
/// offset is applied as a rotation, which moves fixes by more. The offset is therefore corrected by
/// the remaining D until it vanishes.
ChenGuanOffset estimate_chen_guan_offset(const ReferencePointFixes& reference_fixes,
                                         const Eigen::Vector2d& focal_px, DispersionCircle kind,
                                         bool noise_is_stated);

}  // namespace vlp
