// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"

namespace vlp {

/// How the camera of a capture moves: velocity and yaw rate of captures.csv, wherever there are
/// some, that with the table's standard deviation and this one with that which is given; else as
/// `otherwise` says, which is nothing for one that stands.
std::optional<KnownMotion> motion_of(const Capture& capture,
                                     const std::optional<KnownMotion>& otherwise,
                                     double yaw_rate_sd_rad_per_s);

/// The same of each frame; none where all stand.
std::vector<KnownMotion> motions_of(std::span<const Frame> frames, const CapturesTable& captures,
                                    const std::optional<KnownMotion>& otherwise,
                                    double yaw_rate_sd_rad_per_s);

/// Motion wants to know when each row is read: throws std::invalid_argument when the camera lacks
/// row_time_s or readout.
void check_row_time(const Camera& camera);

}  // namespace vlp
