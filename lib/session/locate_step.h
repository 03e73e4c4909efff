// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "evaluation/fix_summary.h"
#include "positioning/positioner.h"
#include "session/step_result.h"

namespace vlp {

/// Captures to locate, and how.
struct LocateInput {
  std::vector<Frame> frames;
  LampMap lamps;
  Calibration calibration;
  /// What is known of them besides their images; inclinations count, wherever there are some.
  CapturesTable captures = {};
  PositionerOptions how = {};
  /// Standard deviation of the lamps' pixels; overrides that of the detections.
  std::optional<double> sigma_px = {};
  /// Standard deviation of the inclination's angles; 0 leaves it out.
  double inclination_sigma_rad = 0;
  /// Takes height and yaw from `captures` if one lamp is seen.
  bool one_lamp = false;
  /// Standard deviation of that yaw; 0: exact. That of the height is height_sd_m.
  double yaw_sd_rad = 0;
  /// Cameras that move and lean. Where `captures` has no velocity: how fast the camera, or the
  /// robot, can drive and turn; nothing: it stands. Velocities in `captures` count wherever there
  /// are some, with that standard deviation of the yaw rate.
  std::optional<KnownMotion> motion = {};
  double yaw_rate_sd_rad_per_s = 0;
  /// Standard deviation of roll and pitch about level where `captures` has no inclination; 0:
  /// level.
  double lean_sd_rad = 0;
  /// Standard deviation of the z_m of `captures`, which then counts.
  std::optional<double> height_sd_m = {};
  /// Of every lamp, too.
  bool lamp_offsets = false;
  /// Captures that are fixed together, with one velocity: this and those before it, within 0.2 s.
  int frames_together = 1;
};

/// What is known of a capture besides its image.
Sensors sensors_of(const std::string& image, const LocateInput& input);

struct LocateResult : StepResult {
  /// Of each frame.
  std::vector<Fix> fixes;
  std::vector<FixRow> rows;
  FixSummary summary;
};

/// The fix of each frame. Metrics: residual_ratio, the noise that the residuals show over the
/// largest that is stated, where all state it. Where not every detection states its sigma_px, one
/// is taken from the residuals, if they show it. Throws std::invalid_argument when a camera moves
/// whose calibration lacks row_time_s or readout. Warns of residuals that the stated noise does not
/// explain, of detections outside the image or where the lens is not known (region_px), of images
/// that `captures` lacks, of lamps left out. undetermined: no frame has a fix.
LocateResult locate_frames(const LocateInput& input);

}  // namespace vlp
