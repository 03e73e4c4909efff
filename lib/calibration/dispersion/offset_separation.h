// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/dispersion/station_fixes.h"

namespace vlp {

/// What is wrong in the camera and what in the world, see fit_dispersion().
struct OffsetSeparation {
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d world_m = Eigen::Vector2d::Zero();
  /// Covariance of both, offset_px first, if the fixes scatter as their covariances state and the
  /// map is exact.
  Eigen::Matrix4d covariance;
  /// Derivatives of both by the places of the lamps, rows in the order of `covariance`.
  LampDerivatives by_lamps = {};
  /// Squared residuals over what those let expect; zero when as many fixes as unknowns are used.
  double excess;
  /// Number of rows of the fixes that are used, minus the unknowns.
  int freedom = 0;
  /// Of each capture.
  std::vector<bool> used;
};

/// Gauss-Newton on fix_k(offset) - station - world, the fixes' derivatives from differences; Cauchy
/// weights first, then plain least squares without outliers (kFixOutlierSigmas). Returns
/// std::nullopt if the captures do not determine it, or it does not converge.
std::optional<OffsetSeparation> separate_offsets(const StationFixes& fixes);

/// Standard deviations beyond which a fix is an outlier, if the variance is known
/// (planar_outlier_bound()).
inline constexpr double kFixOutlierSigmas = 5;
/// Variance below which residuals are rounding.
inline constexpr double kFixRoundingVariance = 1e-24;

}  // namespace vlp
