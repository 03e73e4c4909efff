// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "captures/detections_table.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Options of estimate_tilt_from_lamps().
struct TiltCalibrationOptions {
  /// If true, also estimates corrections of the lamp map (MapPrior::frame).
  /// Captures at different yaws separate a tilt of all lamps from that of the camera. Captures at
  /// different positions determine the distances of the lamps. Lamps that are not detected keep
  /// their positions.
  bool refine_map = false;
  /// Motion of the camera in each frame; empty: stationary. Components with a standard deviation
  /// are estimated together with the pose of the capture. Requires row time and readout direction
  /// of the camera.
  std::vector<KnownMotion> motions = {};
  /// IntrinsicsReport::covariance, if known.
  std::optional<MatrixX> lens_covariance = {};
  /// Largest standard deviation of the zenith per axis. Beyond it, the tilt counts as undetermined.
  double max_sd_rad = 0.02;
  /// Largest standard deviation of the correction of a lamp per axis, with `refine_map`. Beyond it,
  /// the map counts as undetermined.
  double max_lamp_sd_m = 0.01;
};

/// Tilt of a camera, and optionally the corrected lamp map, with their uncertainties.
struct TiltCalibration {
  /// Reason why there is no result, and the remedy, human-readable. Empty if there is a result. The
  /// other members are then valid up to the step that failed.
  std::string undetermined;

  /// Rotation center with model `tilt`.
  RotationCenter center;
  /// Covariance of the zenith's normalized point with an exact lens. It is scaled by the residuals
  /// if they exceed the given noise, and includes the errors of the map by its sd_m.
  MatrixX covariance;
  /// Joint covariance of intrinsics, zenith and lever arm, if that of the lens is known.
  std::optional<MatrixX> joint_covariance = {};
  /// Lamp map with the corrections; unchanged without `refine_map`.
  LampMap map;
  /// Corrections of the detected lamps, with `refine_map` only.
  std::vector<AdjustmentResult::LampCorrection> corrections;

  /// Number of captures that are used, and of captures with fewer than three lamps of the map.
  /// `captures_rejected`: number of captures that contradict the map or the other captures.
  int captures = 0, captures_of_few_lamps = 0, captures_rejected = 0;
  /// Number of detections that are used, and of other detections in captures of three lamps or
  /// more.
  int detections = 0, detections_rejected = 0;
  /// RMS residual per axis in the undistorted image, sqrt(sum of squares / degrees of freedom), for
  /// a level, stationary camera and the original map.
  double residual_before_px = 0;
  /// RMS residual per axis in the image, with the result, over the detections that are used.
  double residual_px = 0;
  /// Ratio of the residuals to the sigma_px of the detections, at least 1. It is 1 if any detection
  /// lacks sigma_px.
  double noise_scale = 1;
};

/// Estimates the tilt of a camera from identified lamps. Three lamps or more over-determine a
/// position fix unless the camera is level.
///
/// @return  tilt and optionally map; `undetermined` states the reason if there is none
///
/// Calls adjust_bundle() with an exact lens and without known positions. The map is
/// weighted by its sd_m, and exact without one. Detections without sigma_px are weighted as in
/// positioning.
///
/// The lamps of each capture first have to agree with the map (Positioner). Captures that do not
/// agree for a level camera, but do at the estimated zenith, are reinstated. Outliers beyond 4.5
/// standard deviations of the residuals are rejected.
///
/// The tilt is undetermined for
///   - fewer than two captures of three lamps
///   - captures that all have the same position and yaw, where an error of the map resembles a tilt
///   - with `refine_map`, captures at one yaw, or at one position, or a lamp in one capture only
///   - standard deviations above the limits of `options`
TiltCalibration estimate_tilt_from_lamps(std::span<const Frame> frames, const LampMap& map,
                                         const Camera& camera,
                                         const TiltCalibrationOptions& options = {});

}  // namespace vlp
