// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

struct LevellingOptions {
  /// Estimates corrections of the lamp map, too (AdjustmentInput::frees_map_shape). Captures at
  /// different yaws separate a tilt of all lamps from the camera's; captures at different places
  /// determine the distances of the lamps. Lamps that are not seen stay.
  bool refine_map = false;
  /// How the camera moves in each of the frames; empty: it stands. What is not known of it is
  /// estimated with the capture's pose. Wants the camera's row time and read-out.
  std::vector<KnownMotion> motions = {};
  /// A standard deviation of the zenith per axis, and of a lamp's correction per axis, beyond
  /// which the captures do not determine it.
  double max_sd_rad = 0.02;
  double max_lamp_sd_m = 0.01;
};

/// The tilt, and maybe the lamp map, from captures of three lamps or more taken anywhere, and how
/// well they are known.
struct Levelling {
  /// Why there is no answer, and what to add; empty when there is one. The figures below hold as
  /// far as they were reached.
  std::string undetermined;

  /// Model `tilt`. The covariance, of the zenith's image, follows the residuals where they are
  /// larger than the detections state, and includes the errors of the map by its sd_m.
  RotationCenter center;
  /// With what was found added; as it was without `refine_map`.
  LampMap map;
  struct LampCorrection {
    int id;
    Eigen::Vector3d correction_m, sd_m;
  };
  /// Of the lamps seen, with `refine_map`.
  std::vector<LampCorrection> corrections;

  /// Captures that it rests on; of fewer than three lamps of the map, which carry nothing; that
  /// contradict themselves or the others.
  int captures = 0, captures_of_few_lamps = 0, captures_rejected = 0;
  /// Detections that it rests on, and those of captures of three lamps or more that it does not.
  int detections = 0, detections_rejected = 0;
  /// Residual per axis of a level camera that stands and the map as it was, in the undistorted
  /// image: sqrt(sum of squares / degrees of freedom).
  double residual_before_px = 0;
  /// The same of the detections used, in the image, with the result.
  double residual_px = 0;
  /// Residuals over the sigma_px of the detections, at least 1; 1 if not all of them state it.
  double excess = 1;
};

/// Levels the camera from identified lamps: three or more over-determine a fix unless the camera
/// is level. A preset of adjust_captures(): the lens is exact, no place is known, the map counts by
/// its sd_m (exact without one), detections without sigma_px weigh as in positioning. The lamps of
/// each capture first have to agree with the map (Positioner); captures that do so at the zenith
/// found, but not for a level camera, are taken in again. Outliers beyond 4.5 standard deviations
/// of the residuals' scatter are then left out. Not determined: fewer than two captures
/// of three lamps; captures all from one place and yaw (from there an error of the map looks like
/// a tilt); with `refine_map` all at one yaw or from one place.
Levelling level_by_lamps(std::span<const Frame> frames, const LampMap& map, const Camera& camera,
                         const LevellingOptions& options = {});

}  // namespace vlp
