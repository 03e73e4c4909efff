// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// Return the parts of a calibration as HTML tables.
std::string make_camera_table(const Camera& camera);
std::string make_intrinsics_table(const IntrinsicsReport& report);
std::string make_rotation_table(const Calibration& calibration);
std::string make_dispersion_table(const Calibration& calibration);

/// Returns the history of a calibration as HTML, one foldable entry per part: program, version and
/// options, and a table of the inputs with their SHA-256.
std::string make_history_list(const std::vector<HistoryEntry>& entries);

}  // namespace vlp
