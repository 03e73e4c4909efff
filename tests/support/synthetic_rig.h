// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "positioning/positioner.h"
#include "support/random.h"

namespace vlp {

/// Synthetic lamps, camera and pose for a test.
struct SyntheticRig {
  LampMap map;
  Calibration calibration;
  Pose camera;
  std::optional<Inclination> inclination;
};

/// Returns a camera of 800 x 600 px, 520 px, with a distorting lens (LENSMODEL_OPENCV8).
Camera synthetic_camera();

/// Returns a camera of the same size with a splined lens of 130 degrees.
Camera splined_camera();

/// Returns a camera of the same size with OPENCV_FISHEYE, to 95 degrees off the axis and beyond.
Camera fisheye_camera();

/// Returns lamps with ids 1, 2, ...
LampMap make_lamp_map(const std::vector<Eigen::Vector3d>& positions_m);

/// Returns eight lamps over 2 x 1.1 m at 1.6 m; the first four are the corners.
LampMap synthetic_lamps();

/// Returns a rotation center of model `tilt`: the camera is tilted by `tilt_rad` to this azimuth.
RotationCenter tilted_by(const Camera& camera, double tilt_rad, double azimuth_rad);

/// Projects the lamps of `rig`: world, level, camera, pixel. Omits lamps that the lens does not
/// image.
std::vector<Detection> seen_from(const SyntheticRig& rig, double sigma_px = 1);

/// Adds normal noise of sigma_px, which all detections have.
std::vector<Detection> with_noise(std::vector<Detection> detections, Random& random);

}  // namespace vlp
