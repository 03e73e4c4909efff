// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/rotation/rotation_fit.h"
#include "captures/detections_table.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// Simulated camera that rotates in place.
struct RotationScene {
  LampMap map = synthetic_lamps();
  Camera camera = synthetic_camera();
  double tilt_rad = 0;
  double azimuth_rad = 0.7;
  Eigen::Vector2d axis_m{0.05, -0.03};
  Eigen::Vector2d lever_arm_m{0, 0};
  std::vector<double> heights_m{0};
  /// Number of captures at each height, at uneven yaws from `first_rad` over `arc_rad`.
  int captures = 12;
  double first_rad = 0.4;
  double arc_rad = 6;
  /// If true, only lamps inside the image are detected.
  bool only_in_image = true;

  RotationCenter truth() const { return tilted_by(camera, tilt_rad, azimuth_rad); }
  /// Returns exact detections with the given `sigma_px`.
  std::vector<Frame> frames(double sigma_px = 1) const;
};

/// Returns a scene with a tilt of 1.5 degrees.
RotationScene tilted_scene(const Eigen::Vector2d& lever_arm_m = {0.012, -0.009},
                           const std::vector<double>& heights_m = {0});

/// Returns the fitted axis; fails the test if the captures are rejected.
RotationFit fit_axis(const RotationScene& scene, const std::vector<Frame>& frames);

/// Returns the frames with noise according to sigma_px.
std::vector<Frame> with_noise(std::vector<Frame> frames, Random& random);

/// Returns the angle between two directions, rad.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace vlp
