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

/// Whether captures of lamps show another lens than the calibration has, for people; empty when
/// they do not. All captures are adjusted together (calibration/adjustment/adjustment.h), without
/// their places, once with the lens as far as its covariance lets it, once with focal lengths and
/// centre free: it is another lens when the residuals are then less than a third, and some corner
/// of the image is a pixel or more elsewhere. Nothing where the captures do not determine it,
/// or are fewer than ten.
std::string lens_fault(std::span<const Frame> frames, const LampMap& map,
                       const Calibration& calibration);

/// Captures of lamps with what is known of their heights.
struct PlacedCaptures {
  std::vector<Frame> frames;
  CapturesTable places;
};

/// Describes a difference between the median height errors of two sets of captures in one line.
/// Cameras of different focal lengths have one; a camera that moved sideways or tilted between the
/// sets has none. Returns an empty string for a difference below 5 mm or three standard deviations
/// of a height, and for fewer than five captures of known height in a set.
std::string find_other_focal_length(const PlacedCaptures& captures, const PlacedCaptures& own,
                                    const LampMap& map, const Calibration& calibration);

/// Describes in one line that the residuals of `frames` are larger than those of `own`, by 3 times
/// and above 0.1 px. Each set is adjusted with its own tilt, so that another center or distortion
/// raises the residuals, and a camera that moved or tilted does not. Returns an empty string
/// without such a difference, and if an adjustment is undetermined.
std::string find_other_lens(std::span<const Frame> frames, std::span<const Frame> own,
                            const LampMap& map, const Calibration& calibration);

}  // namespace vlp
