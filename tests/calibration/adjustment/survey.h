// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/adjustment/adjustment.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// A room with eight lamps at several heights, a camera that leans and sits beside its axis, and
/// captures of it: truth, and what the adjustment gets to know.
struct Survey {
  SyntheticRig truth;
  Eigen::Vector2d lever_arm_m{0.009, -0.004};
  AdjustmentInput input;

  explicit Survey(double map_sd_m = 0.002);

  /// Turns on a spot about the axis: `captures` yaws all round. With a place where `place_sd_m` is
  /// positive, of the axis or of the camera.
  void turn(const Eigen::Vector3d& axis_m, int captures, double place_sd_m = 0,
            PlaceOf of = PlaceOf::axis);
  /// A capture by itself, without a place.
  void stand(const Pose& camera);
  /// Five known places of the axis, twelve captures each.
  void five_places(double place_sd_m);

  /// Of every pixel, place, and lamp of the map, as their standard deviations say.
  void add_noise(Random& random, bool pixels, bool map, bool axes);

  Eigen::Vector3d misplaced(std::size_t lamp, const LampMap& map) const {
    return map.lamps[lamp].position_m - truth.map.lamps[lamp].position_m;
  }
  double sigma_px = 0.03;
};

/// The covariance of a lens of which boards showed the whole image: parameters correlated as those
/// of a board are, from projections of a grid of rays with noise of this size.
Eigen::MatrixXd lens_covariance(const Camera& camera, double sigma_px, int rays_across);

/// Adds to the intrinsics an error of this covariance, which the calibration then states.
void draw_lens(Calibration& calibration, const Eigen::MatrixXd& covariance, Random& random);

}  // namespace vlp
