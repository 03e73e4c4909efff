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

/// Those within five standard deviations of the median fix, at one yaw. Precondition: there is one.
std::vector<bool> near_median(const OptionalFixes& fixes);

}  // namespace vlp
