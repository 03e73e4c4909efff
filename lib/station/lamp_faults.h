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
/// two that are swapped, when the map with the two exchanged fits far better; one that hangs
/// elsewhere, when the map without it does; one that is never seen although lamps around it are.
/// One line for people each; nothing when the map fits, or nothing single mends it.
std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration);

}  // namespace vlp
