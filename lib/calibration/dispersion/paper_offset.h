// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "calibration/dispersion/station_fixes.h"

namespace vlp {

/// The circle of some points. Precondition: there is one.
Circle circle_of(const std::vector<Eigen::Vector2d>& points, DispersionCircle kind);

struct PaperOffset {
  /// `ok`, many_yaws or diverged; otherwise there is nothing below.
  DispersionStatus status;
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  /// Covariance from the scatter of the fixes, at least that of their noise. std::nullopt for the
  /// enclosing circle.
  std::optional<Matrix2> covariance = {};
  /// Derivatives of offset_px by the places of the lamps; empty without a covariance.
  LampDerivatives by_lamps = {};
  /// Of each capture.
  std::vector<bool> used = {};
};

/// The offset with which the circle of the fixes has its centre at the station (eq. 10 and 11), of
/// captures at one yaw. It starts from eq. 12 and 13 as meant, -f e^{-jg} D / H, which is the whole
/// of it where the offset is applied as a shift under lamps of one height; after a rotation centre
/// of model `tilt` it is applied as a turn, which moves fixes by more, and so it is corrected by
/// what is left of D until nothing is. Precondition: there is a fix.
///
/// @param noise_is_stated  whether all detections state their sigma_px; otherwise it is estimated
///                         from the residuals of the fixes
PaperOffset find_paper_offset(const StationFixes& station, const Eigen::Vector2d& focal_px,
                              DispersionCircle kind, bool noise_is_stated);

}  // namespace vlp
