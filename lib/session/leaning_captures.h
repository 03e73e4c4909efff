// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "captures/detections_table.h"
#include "detection/detect_captures.h"
#include "session/locate_step.h"

namespace vlp {

/// Looks at those images again, in their level planes: a frame of each, by name.
using LookAgain = std::function<std::vector<Frame>(const LevelsOfImages&)>;

/// The level planes of the images whose inclination the table tells: lamps are discs of them, not
/// of the plane that is level when the robot is.
LevelsOfImages levels_told(const CapturesTable& captures, const Calibration& calibration,
                           double yaw_in_robot_rad);

/// Lamps are discs of the level plane, and centres that were looked for in another one are off. Of
/// captures whose lean is to be estimated (LocateInput) it turns, from the fix, into the plane that
/// is level by it, until the fix stays where it is to a tenth of its standard deviations. Where the
/// lean may be large or there is no fix yet, the first is of ellipses, which are what a disc of any
/// plane looks like, nearly. A fix that a look in its plane does not bear out is none. A capture
/// without a fix either way keeps the look that shows more lamps.
///
/// Puts what is seen into the frames of `input`; returns the levels of those that changed.
LevelsOfImages look_at_leaning(LocateInput& input, const LookAgain& look);

}  // namespace vlp
