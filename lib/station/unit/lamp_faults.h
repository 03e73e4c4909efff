// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Describes the errors of the map of a station's lamps (calibration/map/map_errors.h), one line
/// each. Requires three captures. Offsets count from `min_offset_px` on, as seen in the image. For
/// a camera that is being calibrated the default is large, so that a small error of the map does
/// not excuse the camera; for a known camera it can be smaller.
std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, double min_offset_px = 2.5);

/// Describes the lamps of the map that no capture contains, one line each. Requires three captures.
std::vector<std::string> unseen_lamps(std::span<const Frame> frames, const LampMap& map);

/// Captures that were taken elsewhere than their table says: fixes of three lamps or more that are
/// off by more than 5 mm and 8 times what the others are off by. One line for people each; nothing
/// for more than one that is more than a tenth of them, for then it is not the places.
std::vector<std::string> place_faults(std::span<const Frame> frames, const LampMap& map,
                                      const Calibration& calibration, const CapturesTable& places);

}  // namespace vlp
