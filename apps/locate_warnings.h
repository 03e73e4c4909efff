// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "positioning/fix.h"
#include "rig/calibration.h"

/// What vlp-locate warns of, on stderr.
namespace vlp {

/// Residuals that the stated noise does not explain.
void warn_of_noise(const std::vector<Frame>& frames, const std::vector<Fix>& fixes);

/// Detections far outside the camera's image.
void warn_of_image(const std::vector<Frame>& frames, const Camera& camera);

/// Images that are not in captures.csv.
void warn_of_captures(const std::vector<Frame>& frames, const CapturesTable& captures);

/// Lamps that are not in the map, or that contradict the others; the latter one by one at
/// --verbose.
void warn_of_lamps_left_out(const std::vector<Frame>& frames, const std::vector<Fix>& fixes);

}  // namespace vlp
