// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "station/station_config.h"

namespace vlp {

/// Angles of a rotation in place that captures cover, from fixes without rotation center.
struct YawCoverage {
  struct Height {
    double z_m;
    int captures;
    double arc_rad;
    /// Yaw sectors with at least one capture at this height: `turn_captures` sectors of equal size
    /// over the full rotation, in order of increasing yaw. The first one is centered at the yaw of
    /// the first capture.
    std::vector<bool> parts;
    /// True if captures and angular range meet the station's criteria.
    bool is_complete = false;
  };
  /// Heights, in increasing order.
  std::vector<Height> heights;
  /// True if heights, captures at each and angular range meet the station's criteria.
  bool sufficient = false;
};

YawCoverage compute_yaw_coverage(const std::vector<Frame>& frames, const StationConfig& config,
                                 const Calibration& calibration);

}  // namespace vlp
