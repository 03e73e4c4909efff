// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "station/station_config.h"

namespace vlp {

/// Which angles of a turn on the spot are there, by fixes without the rotation centre.
struct TurnMap {
  struct Height {
    double z_m;
    int captures;
    double arc_rad;
    /// Whether each of `turn_captures` equal parts of the turn has a capture, from the first
    /// capture's yaw on.
    std::vector<bool> parts;
  };
  /// From low to high.
  std::vector<Height> heights;
  /// Heights, captures at each and arc are what the station wants.
  bool enough = false;
};

TurnMap turn_map(const std::vector<Frame>& frames, const StationConfig& config,
                 const Calibration& calibration);

}  // namespace vlp
