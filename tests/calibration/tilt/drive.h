// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/rotation/spot.h"
#include "captures/detections_table.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// Returns eight lamps and a tilted camera.
SyntheticRig make_tilted_rig(double tilt_rad, double azimuth_rad);

/// Returns captures at random positions and yaws under the lamps, at two heights.
std::vector<Frame> drive(SyntheticRig rig, int captures, Random& random, double sigma_px = 1);

}  // namespace vlp
