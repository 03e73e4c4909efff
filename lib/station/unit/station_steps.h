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

/// Steps of a session (lib/session), applied to the station's observations, with additional metrics
/// of the station. Each step uses the calibration of the step before; the caller adds the history.
namespace vlp {

/// Calibrates the lens from the observations of the board (run_lens_step()), with the
/// board and lens model of the station. Fails with `undetermined` also if some views do not fit the
/// lens of the others, as with images of two cameras.
///
/// Adds the metrics focal_percent, principal_point_px and nominal_difference_px (differences from
/// the nominal lens of the camera type), and board_warp_mm.
StepResult run_station_lens(const StationConfig& config, const std::string& camera_id,
                            Observations seen);

/// Calibrates the rotation center from captures of a rotation in place
/// (run_rotation_step() with RotationMethod::axis). Fails with `undetermined` also if
/// some captures do not fit the result, as with images of two cameras.
StepResult run_station_rotation(const StationConfig& config, const Calibration& calibration,
                                const std::vector<Frame>& frames);

/// Calibrates the dispersion. Positions are those of the table, or else that of the configuration.
/// Fails with wrong_place if fewer captures than the station requires have a position.
StepResult run_station_dispersion(const StationConfig& config, const Calibration& calibration,
                                  const std::vector<Frame>& frames, const CapturesTable& places);

/// Locates captures at known points; the errors are the metrics check_*. Ignores captures without a
/// position. Fails with wrong_place if fewer than the station requires have one.
StepResult run_station_check(const StationConfig& config, const Calibration& calibration,
                             const std::vector<Frame>& frames, const CapturesTable& places);

}  // namespace vlp
