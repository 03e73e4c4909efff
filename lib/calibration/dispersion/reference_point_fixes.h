// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/dispersion/dispersion.h"

namespace vlp {

/// Derivatives of several quantities with respect to the positions of the lamps that have an sd_m
/// in the map.
struct LampDerivatives {
  std::vector<Lamp> lamps;
  /// One row for each quantity, three columns for each lamp.
  Eigen::MatrixXd by_positions;

  /// Returns the changes of the quantities for errors of one standard deviation, one column per
  /// lamp coordinate.
  Eigen::MatrixXd compute_changes() const;
};

/// Position fixes of captures at a reference point, as functions of the dispersion's offset.
class ReferencePointFixes {
 public:
  /// Position fix of one capture for a given offset.
  struct Estimate {
    /// Fix minus reference point.
    Eigen::Vector2d error_m;
    /// Covariance from the noise of this capture alone. Errors that all captures have in common do
    /// not scatter the fixes.
    Eigen::Matrix2d covariance;
    double yaw_rad;
    /// Mean height above the camera of the detected lamps of the map.
    double height_m;
    /// Sum of the squared residuals of the lamps.
    double squared_residuals_px2;
    /// Degrees of freedom of `squared_residuals_px2`.
    int degrees_of_freedom;
  };

  ReferencePointFixes(std::span<const ReferencePointCapture> captures, const LampMap& map,
                      const Calibration& calibration);

  /// Returns the fix of each capture; std::nullopt for captures without a fix.
  std::vector<std::optional<Estimate>> at(const Eigen::Vector2d& offset_px) const;
  /// Computes the derivatives of the fixes, in m, with respect to the positions of the lamps that
  /// are detected and have an sd_m above zero. Differentiates numerically, one coordinate at a
  /// time. The result has two rows for each capture, which are zero without a fix.
  LampDerivatives compute_lamp_derivatives(const Eigen::Vector2d& offset_px) const;
  /// Returns the status of the first capture without a fix; `ok` if there is none.
  FixStatus first_failure() const { return first_failure_; }

 private:
  std::vector<std::optional<Estimate>> at(const Eigen::Vector2d& offset_px,
                                          const LampMap& map) const;

  std::span<const ReferencePointCapture> captures_;
  const LampMap& map_;
  Calibration calibration_;
  FixStatus first_failure_ = FixStatus::ok;
};

}  // namespace vlp
