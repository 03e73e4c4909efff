// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "frontend/observation.h"
#include "rig/calibration.h"
#include "session/step_result.h"
#include "station/station_config.h"

/// The steps of the session (lib/session), fed with what the station has looked at, with the
/// station's own metrics added. Each takes the calibration that the one before gave; the history is
/// left to who calls.
namespace vlp {

/// The lens; metrics, too: focal_percent, center_px, nominal_px, against the type's, board_bend_mm.
StepResult solve_boards(const StationConfig& config, const std::string& camera_id,
                        Observations seen);

StepResult solve_rotation(const StationConfig& config, const Calibration& calibration,
                          const std::vector<Frame>& frames);

/// Places: those of the table, or of the config. wrong_place when fewer captures than the station
/// wants have one.
StepResult solve_dispersion(const StationConfig& config, const Calibration& calibration,
                            const std::vector<Frame>& frames, const CapturesTable& places);

/// Fixes at known points; their errors are the metrics check_*. Captures without a place are not
/// counted; wrong_place when fewer than the station wants have one.
StepResult check_fixes(const StationConfig& config, const Calibration& calibration,
                       const std::vector<Frame>& frames, const CapturesTable& places);

}  // namespace vlp
