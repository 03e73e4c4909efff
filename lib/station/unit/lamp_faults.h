// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// What is wrong with the map of a station's lamps, as far as captures that do not fit it tell: two
/// lamps that are swapped, or a map that is mirrored (calibration/levelling/map_diagnosis.h); one
/// that hangs elsewhere, when the captures do not fit to `fits_px`, the mean residual per capture,
/// and without it do far better: in the mean, and more than a tenth of those that see it, two or
/// more, each by itself, so that no single reflection is held against a lamp. A line for people;
/// nothing when the map fits, or nothing single mends it. A camera that is being calibrated may be
/// a pixel off; of one that is known less is asked.
std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, double fits_px = 1);

/// The lamps of the map that no capture sees, when there are three captures or more. One line for
/// people each.
std::vector<std::string> unseen_lamps(std::span<const Frame> frames, const LampMap& map);

/// Captures that were taken elsewhere than their table says: fixes of three lamps or more that are
/// off by more than 5 mm and 8 times what the others are off by. One line for people each; nothing
/// for more than one that is more than a tenth of them, for then it is not the places.
std::vector<std::string> place_faults(std::span<const Frame> frames, const LampMap& map,
                                      const Calibration& calibration, const CapturesTable& places);

/// The row time that the camera has in truth, when lights that are like no lamp would all be lamps
/// of the map with it: `frequencies_hz` are theirs with `row_time_s`, f' = f true row time /
/// row_time_s. Four fifths of them, of three lamps or more, have to fit to 1 %, and it has to lie
/// within 40 %. Nothing when that is `row_time_s` to within what lights may be off a lamp
/// (kMaxUnclearDrift): then they are like two lamps of the map, not like none.
std::optional<double> row_time_that_fits(std::span<const double> frequencies_hz, const LampMap& map,
                                         double row_time_s);

}  // namespace vlp
