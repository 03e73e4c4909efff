// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// What is wrong with the lamps of a station, as far as captures that do not fit the map tell it:
/// two that are swapped, or a map that is mirrored (calibration/levelling/map_doubt.h); one that
/// hangs elsewhere, when the map without it fits far better; one that is never seen.
/// One line for people each; nothing when the map fits, or nothing single mends it.
std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration);

}  // namespace vlp
