// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

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

}  // namespace vlp
