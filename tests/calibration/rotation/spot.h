// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/rotation/turning_axis.h"
#include "captures/detections_table.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// A camera that turns on the spot, made up for a test.
struct SpotScene {
  LampMap map = synthetic_lamps();
  Camera camera = synthetic_camera();
  double tilt_rad = 0;
  double azimuth_rad = 0.7;
  Eigen::Vector2d axis_m{0.05, -0.03};
  Eigen::Vector2d lever_arm_m{0, 0};
  std::vector<double> heights_m{0};
  /// At each height: uneven angles, the first at `first_rad`, so many over `arc_rad`.
  int captures = 12;
  double first_rad = 0.4;
  double arc_rad = 6;
  /// Only lamps wholly in the image are seen, unless this is false.
  bool only_in_image = true;

  RotationCenter truth() const { return tilted_by(camera, tilt_rad, azimuth_rad); }
  /// What it sees, computed forwards and without noise, and stated to have this noise.
  std::vector<Frame> frames(double sigma_px = 1) const;
};

/// Tilted by 1.5 degrees.
SpotScene tilted_scene(const Eigen::Vector2d& lever_arm_m = {0.012, -0.009},
                       const std::vector<double>& heights_m = {0});

/// The axis found in such frames; fails the test when they are refused.
RotationFit fit_of(const SpotScene& scene, const std::vector<Frame>& frames);

std::vector<Frame> with_noise(std::vector<Frame> frames, Random& random);

/// The angle between two directions.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace vlp
