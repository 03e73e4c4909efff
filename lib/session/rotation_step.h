// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/levelling/levelling.h"
#include "calibration/map/map_errors.h"
#include "calibration/rotation/circle_center.h"
#include "session/lamp_captures.h"
#include "session/step_result.h"

namespace vlp {

/// Without rotation centre and dispersion.
Calibration camera_alone(const Calibration& calibration);

/// Checks the lamp map by the captures in which the camera stands (calibration/map/map_errors.h).
/// Warns of lamps that hang elsewhere. If the map cannot be used the step fails: wrong_map.
MapErrors check_map(const LampCaptures& input, const Calibration& calibration, StepResult& result);

/// Changes the failure of a step to wrong_map if the lamp map has errors, and its reason to these.
void blame_map(const LampCaptures& input, const Calibration& calibration, StepResult& result);

enum class RotationMethod {
  axis,   // fit_turning_axis()
  joint,  // fit_joint_center()
  circle  // fit_circle_centers()
};

struct RotationResult : StepResult {
  SpotCaptures spot;
  RotationFit fit;
  CircleCenters circles;
};

/// Rotation centre and tilt from captures of a turn on the spot. Metrics: rotation_px,
/// rotation_spread_px, tilt_deg, and where they are known rotation_sd_px, lever_arm_mm. wrong_map,
/// undetermined.
RotationResult solve_rotation(const LampCaptures& input, RotationMethod method, HistoryEntry entry);

struct LevellingResult : StepResult {
  Levelling levelling;
};

/// Tilt, and on request the lamp map, from captures taken anywhere (calibration/levelling).
/// Metrics: tilt_deg. wrong_map, undetermined. Throws std::invalid_argument when a camera moves
/// whose calibration lacks row_time_s or readout.
LevellingResult solve_levelling(const LampCaptures& input, bool refine_map, HistoryEntry entry);

}  // namespace vlp
