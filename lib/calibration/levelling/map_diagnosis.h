// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// What in particular is wrong with a lamp map that captures contradict, for people; empty when
/// nothing shows, or most of the captures of three lamps or more agree with the map. Said is
///   mirrored  when most of them fit the mirror image of the map, and no exchange explains more;
///   swapped   when most of them fit the map once two lamps change places, twice as many as for any
///             other two lamps and as without.
/// Whatever sigma_px the detections state, a lamp contradicts the others as it does where none is
/// stated (fix_robustly); a tilt that is not in the calibration may be up to five degrees.
std::string diagnose_map(std::span<const Frame> frames, const LampMap& map,
                         const Calibration& calibration);

/// Whether most of the captures of three lamps or more have no fix, by the same rules.
bool contradicts_map(std::span<const Frame> frames, const LampMap& map,
                     const Calibration& calibration);

}  // namespace vlp
