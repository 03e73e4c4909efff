// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "positioning/positioner.h"
#include "support/random.h"

namespace vlp {

/// Lamps, a camera and a place to see them from, made up for a test.
struct SyntheticRig {
  LampMap map;
  Calibration calibration;
  Pose camera;
  std::optional<Inclination> inclination;
};

/// 800 x 600, 520 px, with a lens that distorts (LENSMODEL_OPENCV8).
Camera synthetic_camera();

/// Of the same size, with a splined lens of 130 degrees.
Camera splined_camera();

/// Of the same size, with OPENCV_FISHEYE: its lens sees to 95 degrees off the axis and beyond.
Camera fisheye_camera();

/// Lamps with ids 1, 2, ...
LampMap lamp_map_of(const std::vector<Eigen::Vector3d>& positions_m);

/// Eight lamps over 2 x 1.1 m at 1.6 m, the first four of them the corners.
LampMap synthetic_lamps();

/// A rotation centre of model `tilt`: the camera leans by this angle towards this azimuth.
RotationCenter tilted_by(const Camera& camera, double tilt_rad, double azimuth_rad);

/// Where the camera of `rig` sees its lamps, computed forwards: world, level, camera, pixel.
/// Lamps that the lens does not see are left out.
std::vector<Detection> seen_from(const SyntheticRig& rig, double sigma_px = 1);

/// `detections` with normal noise of their sigma_px, which they state, added.
std::vector<Detection> with_noise(std::vector<Detection> detections, Random& random);

}  // namespace vlp
