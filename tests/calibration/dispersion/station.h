// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "calibration/tilt/drive.h"

namespace vlp {

/// Camera at a reference point. Its calibrated zenith has an angular error.
struct Station {
  explicit Station(double error_rad) : believed(rig.calibration) {
    believed.rotation_center = tilted_by(believed.camera, 0.05 - error_rad, 1 + error_rad);
  }

  /// Returns captures at equally spaced yaws, optionally at two heights. The assumed reference
  /// point has the error -`wrong_m`.
  std::vector<ReferencePointCapture> captures(int count, bool heights,
                                              const Eigen::Vector2d& wrong_m,
                                              double sigma_px = 0.1) {
    std::vector<ReferencePointCapture> captures;
    for (int i = 0; i < count; ++i) {
      rig.camera = {{0.05, -0.1, heights && i % 2 ? 0.3 : 0.0}, 6.28 * i / count};
      captures.push_back({seen_from(rig, sigma_px), rig.camera.position_m.head<2>() - wrong_m});
    }
    return captures;
  }
  std::vector<ReferencePointCapture> captures_at(double yaw_rad, int count, double sigma_px = 0.1) {
    rig.camera = {{0.05, -0.1, 0}, yaw_rad};
    return {static_cast<std::size_t>(count),
            {seen_from(rig, sigma_px), rig.camera.position_m.head<2>()}};
  }

  SyntheticRig rig = make_tilted_rig(0.05, 1);
  Calibration believed;
};

}  // namespace vlp
