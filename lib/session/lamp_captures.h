// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "captures/detections_table.h"
#include "positioning/known_motion.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Captures of lamps with the lamp map and the calibration of the camera.
struct LampCaptures {
  std::vector<Frame> frames;
  LampMap lamps;
  std::filesystem::path lamps_file;
  Calibration calibration;
  /// Motion of the camera in each frame; empty: the camera stands.
  std::vector<KnownMotion> motions = {};
};

}  // namespace vlp
