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

/// Returns a calibration with the camera of `calibration` only, without rotation center and
/// dispersion.
Calibration extract_camera(const Calibration& calibration);

/// Checks the lamp map with the captures of a stationary camera or, if these show no error, with
/// all captures (calibration/map/map_errors.h). Adds a warning to `result` for each error that
/// names lamps. If the map is unusable, sets the failure of `result` to wrong_map.
/// @return all errors found, and the offsets of all lamps
MapErrors check_lamp_map(const LampCaptures& input, const Calibration& calibration,
                         StepResult& result);

/// Replaces the failure of a step by wrong_map if the lamp map has errors, and its message by a
/// description of them.
void explain_by_map_errors(const LampCaptures& input, const Calibration& calibration,
                           StepResult& result);

/// Estimator of the rotation center.
enum class RotationMethod {
  axis,   // fit_rotation_axis()
  circle  // fit_circle_centers()
};

/// Names of the estimators on the command line and in plots.
inline constexpr std::array<std::pair<std::string_view, RotationMethod>, 2> kRotationMethods{
    {{"axis", RotationMethod::axis}, {"circle", RotationMethod::circle}}};

/// Formats a height in meters, without a sign if it rounds to zero.
std::string format_height_m(double z_m);

/// Result of run_rotation_step().
struct RotationResult : StepResult {
  RotationCaptures rotation;
  RotationFit fit;
  CircleCenters circles;
};

/// Estimates rotation center and tilt from captures of a rotation in place. Metrics: rotation_px,
/// tilt_deg, and if available rotation_spread_px, rotation_sd_px, lever_arm_mm. Failures:
/// wrong_map, undetermined.
RotationResult run_rotation_step(const LampCaptures& input, RotationMethod method,
                                 HistoryEntry entry);

/// Result of run_tilt_step().
struct TiltResult : StepResult {
  TiltCalibration tilt;
};

/// Estimates the tilt from captures taken anywhere (calibration/tilt/), and the lamp map if
/// `refine_map` is set. Metrics: tilt_deg. Failures: wrong_map, undetermined. Throws
/// std::invalid_argument if the camera moves and its calibration lacks row_time_s or readout.
TiltResult run_tilt_step(const LampCaptures& input, bool refine_map, HistoryEntry entry);

}  // namespace vlp
