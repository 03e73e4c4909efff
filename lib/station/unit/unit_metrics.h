// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "evaluation/evaluation.h"
#include "rig/calibration.h"
#include "session/lens_step.h"
#include "session/locate_step.h"
#include "session/step_result.h"
#include "station/station_config.h"

namespace vlp {

/// Adds the differences between a lens and the nominal one of its type of camera: focal_percent,
/// principal_point_px and nominal_difference_px; and board_warp_mm.
void add_nominal_differences(const Camera& type, LensResult& result);

/// Captures at known points, with their fixes.
struct KnownPointFixes {
  std::vector<Frame> frames;
  LocateResult located;
  /// Fixes and points.
  EvaluationInput input;
};

/// Locates the captures whose position is known; no fixes if there are none.
KnownPointFixes locate_known_points(const StationConfig& config, const Calibration& calibration,
                                    const std::vector<Frame>& frames, const CapturesTable& places);

/// Locates captures at known points; the errors are the metrics check_*. Ignores captures without a
/// position. Fails with wrong_place if fewer than the station requires have one.
StepResult run_check_step(const StationConfig& config, const Calibration& calibration,
                          const std::vector<Frame>& frames, const CapturesTable& places);

}  // namespace vlp
