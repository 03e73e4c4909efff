// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "positioning/known_motion.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Captures of lamps with the lamp map and the calibration of the camera.
struct LampCaptures {
  std::vector<Frame> frames;
  LampMap lamps;
  std::filesystem::path lamps_file;
  Calibration calibration;
  /// Motion of the camera in each frame, in the order of `frames`. Empty: the camera is at rest in
  /// all frames.
  std::vector<KnownMotion> motions = {};
};

/// Returns the motion of the camera in a capture: velocity and yaw rate of captures.csv, each
/// replaced by that of `default_motion` if the table lacks it.
///
/// @param default_motion              motion without a table; std::nullopt: the camera stands
/// @param yaw_rate_sd_rad_per_s  standard deviation of the table's yaw rate; the standard deviation
///                               of its velocity is in the table
std::optional<KnownMotion> find_motion(const Capture& capture,
                                       const std::optional<KnownMotion>& default_motion,
                                       double yaw_rate_sd_rad_per_s);

/// Returns find_motion() for each frame; an empty vector if the camera stands in all of
/// them.
std::vector<KnownMotion> list_capture_motions(std::span<const Frame> frames,
                                              const CapturesTable& captures,
                                              const std::optional<KnownMotion>& default_motion,
                                              double yaw_rate_sd_rad_per_s);

/// Checks that the camera has row_time_s and readout, which motion compensation requires. Throws
/// std::invalid_argument otherwise.
void check_timing_known(const Camera& camera);

}  // namespace vlp
