// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "program/steps/capture_options.h"

namespace vlp {

/// Options of --method lamps besides the captures.
struct TiltOptions {
  /// Path of the file for the refined lamp map. If empty, the map is not refined.
  std::string refined_map;
  /// File captures.csv; empty: the one in the folder, if it exists.
  std::string captures;
  MotionOptions motion;
  std::optional<double> yaw_rate_sd_deg_per_s;
};

/// Estimates the tilt of the camera from captures taken anywhere (calibration/tilt/), for
/// vlp-rotation --method lamps.
void run_tilt_program(const CLI::App& app, CaptureOptions images, const TiltOptions& options);

/// Estimates the rotation center from captures of a rotation in place (calibration/rotation/), for
/// vlp-rotation --method axis|circle. `plot` is the file of the plot; empty: none.
void run_rotation_program(const CLI::App& app, CaptureOptions images, const std::string& method,
                          const std::string& plot);

}  // namespace vlp
