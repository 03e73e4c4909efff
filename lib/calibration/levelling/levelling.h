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
  /// Estimate corrections of the lamp map, too. Captures with free poses say nothing of where
  /// the map as a whole is, how it is turned about the vertical, nor how large it is: those five
  /// are held, so that the corrections d_i of the lamps seen have, with p_i from their mean,
  ///   sum d_i = 0,   sum (p_i x d_i)_z = 0,   sum p_i . d_i = 0.
  /// A tilt of the lamps as a whole is told from the camera's by captures at different yaws, the
  /// distance of a lamp by captures at different places. Lamps that are not seen stay.
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

  /// Model `tilt`; the covariance, of the zenith's image, follows the residuals where they are
  /// larger than what the detections state, and has the errors of a held map by its sd_m.
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
  /// Of the former, per axis in the undistorted image, degrees of freedom
  /// taken off: sqrt(sum of squares / (2 detections - unknowns)). Before: of a level camera and
  /// the map as it was.
  double residual_before_px = 0, residual_px = 0;
  /// Of the residuals, over what the detections state; 1 where not all of them state it.
  double excess = 1;
};

/// Levels the camera from identified lamps: three or more over-determine a fix unless the camera
/// is level. Least squares over one tilt, a pose per capture and, maybe, the lamp map (see
/// LampBundle); lamps weigh as in positioning (Positioner). Whatever contradicts the rest by more
/// than five standard deviations, of the residuals' median, is left out, the worst of each capture
/// first. The poses are not used beyond this. Not determined: fewer than two captures of three
/// lamps, captures all from one place and yaw (from there a map that is a little off looks like a
/// tilt), with `refine_map` all at one yaw or from one place.
Levelling level_by_lamps(std::span<const Frame> frames, const LampMap& map, const Camera& camera,
                         const LevellingOptions& options = {});

}  // namespace vlp
