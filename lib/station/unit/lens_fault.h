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

/// Describes a contradiction between captures of lamps and the calibrated lens; empty if there is
/// none.
///
/// All captures are adjusted together (calibration/adjustment/adjustment.h), without known
/// positions. The first adjustment limits the lens by its covariance; the second has free focal
/// lengths and center. The lens is another one under two conditions. The second residual is below a
/// third of the first, and a corner of the image moves by 1 px or more.
///
/// Returns an empty string if an adjustment is undetermined, and for fewer than ten captures.
std::string describe_lens_fault(std::span<const Frame> frames, const LampMap& map,
                                const Calibration& calibration);

/// Captures of lamps with their known heights.
struct PlacedCaptures {
  std::vector<Frame> frames;
  CapturesTable places;
};

/// Describes a difference between the median height errors of two sets of captures in one line.
/// Cameras of different focal lengths have one. A camera that moved sideways or tilted between the
/// sets has none.
///
/// Returns an empty string for a difference below 5 mm or three standard deviations of a height.
/// Returns an empty string, too, if a set has fewer than five captures of known height.
std::string find_other_focal_length(const PlacedCaptures& captures, const PlacedCaptures& reference,
                                    const LampMap& map, const Calibration& calibration);

/// Describes in one line that the residuals of `frames` are larger than those of `reference`, by 3
/// times and above 0.1 px. Each set is adjusted with its own tilt, so that another center or
/// distortion raises the residuals, and a camera that moved or tilted does not. Returns an empty
/// string without such a difference, and if an adjustment is undetermined.
std::string find_other_lens(std::span<const Frame> frames, std::span<const Frame> reference,
                            const LampMap& map, const Calibration& calibration);

}  // namespace vlp
