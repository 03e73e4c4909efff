// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/dispersion/dispersion.h"

namespace vlp {

/// Derivatives of some quantities by the places of lamps that the map states an sd_m of.
struct LampDerivatives {
  std::vector<Lamp> lamps;
  /// A row for each quantity, three columns for each lamp.
  Eigen::MatrixXd by_positions;

  /// Returns the moves of the quantities by errors of one standard deviation, a column each.
  Eigen::MatrixXd compute_moves() const;
};

/// The fixes of captures at a station, as functions of the dispersion's offset.
class StationFixes {
 public:
  struct At {
    /// Fix minus station.
    Eigen::Vector2d error_m;
    /// Of this capture's noise alone: what all have in common does not scatter them.
    Eigen::Matrix2d covariance;
    double yaw_rad;
    /// Of the lamps it rests on, above it.
    double height_m;
    /// Sum of the squared residuals of its lamps, and its degrees of freedom.
    double squared_residuals_px2;
    int degrees_of_freedom;
  };

  StationFixes(std::span<const StationCapture> captures, const LampMap& map,
               const Calibration& calibration);

  /// Of each capture; nothing where there is no fix.
  std::vector<std::optional<At>> at(const Eigen::Vector2d& offset_px) const;
  /// Computes the derivatives of the fixes, in m, by the places of the lamps that are detected and
  /// have an sd_m above zero, by a difference each. Two rows for each capture, zero without a fix.
  LampDerivatives compute_lamp_derivatives(const Eigen::Vector2d& offset_px) const;
  /// Of captures without one.
  FixStatus first_refusal() const { return first_refusal_; }

 private:
  std::vector<std::optional<At>> at(const Eigen::Vector2d& offset_px, const LampMap& map) const;

  std::span<const StationCapture> captures_;
  const LampMap& map_;
  Calibration calibration_;
  FixStatus first_refusal_ = FixStatus::ok;
};

}  // namespace vlp
