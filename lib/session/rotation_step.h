// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "calibration/map/map_errors.h"
#include "calibration/rotation/circle_center.h"
#include "calibration/tilt/tilt_calibration.h"
#include "session/lamp_captures.h"
#include "session/step_result.h"

namespace vlp {

/// Returns the camera part of a calibration, without rotation center and dispersion.
Calibration extract_camera(const Calibration& calibration);

/// Checks the lamp map with the captures in which the camera stands (calibration/map/map_errors.h).
/// Adds warnings of lamps that hang elsewhere to `result`. Fails with wrong_map if the map is
/// unusable.
MapErrors check_map(const LampCaptures& input, const Calibration& calibration, StepResult& result);

/// Replaces the failure of a step by wrong_map if the lamp map has errors, and its message by a
/// description of them.
void explain_failure_by_map(const LampCaptures& input, const Calibration& calibration,
                            StepResult& result);

/// Estimator of the rotation center.
enum class RotationMethod {
  axis,   // fit_rotation_axis()
  joint,  // fit_joint_center()
  circle  // fit_circle_centers()
};

/// Names of the estimators on the command line and in plots.
inline constexpr std::array<std::pair<std::string_view, RotationMethod>, 3> kRotationMethods{
    {{"axis", RotationMethod::axis},
     {"joint", RotationMethod::joint},
     {"circle", RotationMethod::circle}}};

/// Formats a height in meters, without a sign if it rounds to zero.
std::string format_height_m(double z_m);

/// Result of solve_rotation().
struct RotationResult : StepResult {
  RotationCaptures spot;
  RotationFit fit;
  CircleCenters circles;
};

/// Estimates rotation center and tilt from captures of a rotation in place. Metrics: rotation_px,
/// tilt_deg, and if available rotation_spread_px, rotation_sd_px, lever_arm_mm. Failures:
/// wrong_map, undetermined.
RotationResult solve_rotation(const LampCaptures& input, RotationMethod method, HistoryEntry entry);

/// Result of solve_leveling().
struct LevelingResult : StepResult {
  TiltCalibration leveling;
};

/// Estimates the tilt from captures taken anywhere (calibration/leveling), and the lamp map if
/// `refine_map` is set. Metrics: tilt_deg. Failures: wrong_map, undetermined. Throws
/// std::invalid_argument if the camera moves and its calibration lacks row_time_s or readout.
LevelingResult solve_leveling(const LampCaptures& input, bool refine_map, HistoryEntry entry);

}  // namespace vlp
