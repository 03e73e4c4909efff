// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/dispersion/dispersion.h"

namespace vlp {

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
  /// Computes the moves of the fixes by errors of the map of one standard deviation (Lamp::sd_m),
  /// in m, by a difference each.
  ///
  /// @return  two rows for each capture, zero without a fix; a column for each coordinate of each
  ///          lamp that is detected and is not exact
  Eigen::MatrixXd compute_map_displacements_m(const Eigen::Vector2d& offset_px) const;
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
