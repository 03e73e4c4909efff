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
/// each. Requires three captures. Offsets below `min_offset_px` in the image are ignored. The
/// default is large, so that small errors of the map do not excuse a camera that is being
/// calibrated. It can be smaller for a known camera.
std::vector<std::string> list_lamp_map_faults(std::span<const Frame> frames, const LampMap& map,
                                              const Calibration& calibration,
                                              double min_offset_px = 2.5);

/// Returns a message for each lamp of the map that no frame contains, one line each. Empty if all
/// lamps were detected, and for fewer than three frames.
std::vector<std::string> list_missing_lamps(std::span<const Frame> frames, const LampMap& map);

/// Describes a contradiction between captures of lamps and the calibrated lens; empty if there is
/// none.
///
/// All captures are adjusted together (calibration/adjustment/adjustment.h), without known
/// positions. The first adjustment limits the lens by its covariance; the second has free focal
/// lengths and center. The lens is another one under two conditions. The second residual is below a
/// third of the first, and a corner of the image moves by 1 px or more.
///
/// Returns an empty string if an adjustment is undetermined, and for fewer than ten captures.
std::string explain_lens_contradiction(std::span<const Frame> frames, const LampMap& map,
                                       const Calibration& calibration);

/// Captures of lamps with their known heights.
struct CapturesWithPositions {
  std::vector<Frame> frames;
  CapturesTable positions;
};

/// Describes a difference between the median height errors of two sets of captures in one line.
/// Cameras of different focal lengths have one. A camera that moved sideways or tilted between the
/// sets has none.
///
/// Returns an empty string for a difference below 5 mm or three standard deviations of a height.
/// Returns an empty string, too, if a set has fewer than five captures of known height.
std::string explain_focal_difference(const CapturesWithPositions& captures,
                                     const CapturesWithPositions& reference, const LampMap& map,
                                     const Calibration& calibration);

/// Describes in one line that the residuals of `frames` are larger than those of `reference`, by 3
/// times and above 0.1 px. Each set is adjusted with its own tilt. Another center or distortion
/// therefore raises the residuals, and a camera that moved or tilted does not. Returns an empty
/// string without such a difference, and if an adjustment is undetermined.
std::string explain_other_lens(std::span<const Frame> frames, std::span<const Frame> reference,
                               const LampMap& map, const Calibration& calibration);

}  // namespace vlp
