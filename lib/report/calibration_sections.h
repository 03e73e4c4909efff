// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// Return the parts of a calibration as HTML tables.
std::string camera_table(const Camera& camera);
std::string intrinsics_table(const IntrinsicsReport& report);
std::string format_rotation_table(const RotationCenter& center);
std::string dispersion_table(const Dispersion& dispersion, const Eigen::Vector2d& focal_px);

/// Returns a foldable list in HTML: program, version and options of each part, and the digests of
/// its inputs.
std::string history_list(const std::vector<HistoryEntry>& entries);

}  // namespace vlp
