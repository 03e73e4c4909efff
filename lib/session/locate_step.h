// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "captures/poses_table.h"
#include "evaluation/fix_summary.h"
#include "frontend/lamp_intake.h"
#include "frontend/observation.h"
#include "positioning/positioner.h"
#include "session/step_result.h"

namespace vlp {

/// Input of locate_from_detections(): captures, lamp map, calibration, and options of the
/// positioner.
struct LocateInput {
  std::vector<Frame> frames;
  LampMap lamps;
  Calibration calibration;
  /// Rows of captures.csv, by image name. Times, motions and inclinations are always used. Heights
  /// and yaws are used only with `allow_single_lamp` or `height_sd_m`.
  CapturesTable captures = {};
  PositionerOptions positioner_options = {};
  /// Standard deviation of the lamp positions in the image, per axis; overrides that of the
  /// detections.
  std::optional<double> sigma_px = {};
  /// Standard deviation of the angles of an inclination in `captures`, rad; 0: exact.
  double inclination_sigma_rad = 0;
  /// Uses height and yaw of `captures` if only one lamp is detected.
  bool allow_single_lamp = false;
  /// Standard deviation of the yaw of `captures` for fixes of one lamp; 0: exact. That of the
  /// height is height_sd_m.
  double yaw_sd_rad = 0;
  /// Prior of the motion of captures without velocity and yaw rate in `captures`: speed and yaw
  /// rate of the camera or robot. std::nullopt: the camera stands. Velocities and yaw rates in
  /// `captures` are always used, yaw rates with the standard deviation `yaw_rate_sd_rad_per_s`.
  std::optional<KnownMotion> motion = {};
  double yaw_rate_sd_rad_per_s = 0;
  /// Standard deviation of roll and pitch of captures without an inclination in `captures`, about
  /// level; 0: level.
  double roll_pitch_sd_rad = 0;
  /// Standard deviation of z_m of `captures`. std::nullopt: z_m is not used as a measurement.
  std::optional<double> height_sd_m = {};
  /// If true, computes the offset of each lamp from its position in the map
  /// (StepResult::lamp_offsets).
  bool compute_lamp_offsets = false;
  /// Number of captures in a joint fix with a common velocity: the capture and those up to 0.2 s
  /// before it.
  int window_size = 1;
};

/// Returns the sensor data of a capture: motion, time, inclination, height and yaw.
Sensors make_sensor_readings(const std::string& image, const LocateInput& input);

/// Counts the detections outside the image by more than 10 % of its width or height. The center of
/// a lamp at the image's edge may be slightly outside.
std::size_t count_outside_image(std::span<const Frame> frames, const std::array<int, 2>& imager_px);

/// Result of locate_from_detections().
struct LocateResult : StepResult {
  /// Fix of each frame, in the order of LocateInput::frames.
  std::vector<Fix> fixes;
  /// Rows of fixes.csv, in the order of `fixes`.
  std::vector<FixRow> rows;
  /// Rows of poses.csv: one for each fix whose roll and pitch are estimated. The orientation is
  /// that of the camera, corrected by its calibrated tilt. With a mount, the pose is that of the
  /// robot.
  std::vector<PoseRow> poses;
  FixSummary summary;
  /// Observations of the images in which the lamps were detected (locate_from_images()).
  Observations observations = {};
};

/// Estimates the fix of each frame.
///
/// Frames with detections without sigma_px use the noise estimated from the residuals, if these
/// have redundancy. Standard deviations follow residuals that exceed the reported noise.
///
/// Metrics: residual_ratio, the noise estimated from the residuals divided by the largest sigma_px,
/// if all detections have one. Failure: undetermined, if no frame has a fix.
/// Warnings: residuals larger than the reported noise explains; detections outside the image or the
/// calibrated region (region_px); images missing in `captures`; rejected lamps.
/// @throws std::invalid_argument if a camera moves and its calibration lacks row_time_s or readout
LocateResult locate_from_detections(const LocateInput& input);

/// Detects the lamps in images (detect_lamps()) and locates the camera of each image.
/// `input` holds everything except the frames. If the tilt of a camera is estimated, its lamps are
/// detected again in the plane that is level by its fix (locate_with_repeated_detection()).
///
/// Skipped images and remarks of the intake are part of the result. It fails as
/// locate_from_detections() does, or if no lamp is identified.
/// @throws as detect_lamps() and locate_from_detections()
LocateResult locate_from_images(const LampImages& images, ImageUse use, LocateInput input,
                                const FrontendOptions& options,
                                const IntakeProgress& progress = {});

}  // namespace vlp
