// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/rotation/spot.h"
#include "captures/detections_table.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// Eight lamps and a camera that leans.
SyntheticRig leaning_rig(double tilt_rad, double azimuth_rad);

/// Captures from places and yaws at random under the lamps, at two heights.
std::vector<Frame> drive(SyntheticRig rig, int captures, Random& random, double sigma_px = 1);

}  // namespace vlp
