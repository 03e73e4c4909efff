// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "program/steps/capture_options.h"

namespace vlp {

/// What --method lamps takes besides captures.
struct LevelOptions {
  /// Empty when the lamp map stays.
  std::string refined_map;
  /// captures.csv; empty: that of the folder, if it is there.
  std::string captures;
  MotionOptions motion;
  std::optional<double> yaw_rate_sd_deg_per_s;
};

/// vlp-rotation --method lamps: levels the camera from captures taken anywhere
/// (calibration/levelling.h).
void rotate_by_lamps(const CLI::App& app, CaptureOptions images, const LevelOptions& options);

}  // namespace vlp
