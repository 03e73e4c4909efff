// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/adjustment/adjustment.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// Simulated room with eight lamps at several heights and captures of a tilted camera beside its
/// axis: ground truth, and the input of the adjustment.
struct Survey {
  SyntheticRig truth;
  Eigen::Vector2d lever_arm_m{0.009, -0.004};
  AdjustmentInput input;

  explicit Survey(double map_sd_m = 0.002);

  /// Adds a rotation in place about the axis: `captures` yaws over the full circle. If
  /// `position_sd_m` is positive, the position of the axis or of the camera is known.
  void turn(const Eigen::Vector3d& axis_m, int captures, double position_sd_m = 0,
            MeasuredPoint of = MeasuredPoint::axis);
  /// Adds a capture with a position of its own that is not known.
  void stand(const Pose& camera);
  /// Adds five rotations about known axes, twelve captures each.
  void five_places(double position_sd_m);

  /// Adds noise to pixels, known positions and lamps of the map, according to their standard
  /// deviations.
  void add_noise(Random& random, bool pixels, bool map, bool axes);

  Eigen::Vector3d misplaced(std::size_t lamp, const LampMap& map) const {
    return map.lamps[lamp].position_m - truth.map.lamps[lamp].position_m;
  }
  double sigma_px = 0.03;
};

/// Returns the covariance of a lens calibrated with boards over the whole image. The parameters are
/// correlated like those of a board calibration: it uses projections of a grid of rays with noise
/// `sigma_px`.
Eigen::MatrixXd lens_covariance(const Camera& camera, double sigma_px, int rays_across);

/// Adds an error with this covariance to the intrinsics, and stores the covariance in the
/// calibration.
void draw_lens(Calibration& calibration, const Eigen::MatrixXd& covariance, Random& random);

}  // namespace vlp
