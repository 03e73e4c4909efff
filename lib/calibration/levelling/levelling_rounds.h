// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/levelling/lamp_bundle.h"
#include "calibration/levelling/measured_lamps.h"
#include "rig/lamp_map.h"

namespace vlp {

struct LevellingSolution {
  LampBundle bundle;
  /// Nothing when the captures do not determine it.
  std::optional<BundleFit> fit;
};

/// The adjusted bundle of what captures show (measured_lamps()), without what contradicts the rest,
/// see level_by_lamps(). `lamps_m` are the map's places from their mean. The captures are seen anew
/// with each tilt found, since a tilt makes good lamps look wrong, until the same detections agree.
LevellingSolution solve_in_rounds(const std::vector<MeasuredCapture>& measured, const LampMap& map,
                                  const std::vector<Eigen::Vector3d>& lamps_m, bool refine_map);

}  // namespace vlp
