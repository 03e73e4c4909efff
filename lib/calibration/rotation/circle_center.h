// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"
#include "geometry/circle_fit.h"

namespace vlp {

/// The circle that a lamp traces at one height in the plane of normalized points (x/z, y/z), which
/// is the undistorted image in units of the focal length.
struct LampCircle {
  /// Indices in SpotCaptures.
  std::size_t lamp;
  std::size_t height;
  CircleFit fit;
};

struct CircleCenters {
  /// The mean of the centres. `yaws_rad` are those of the captures' fixes. The residual is across
  /// the circles, each of which has three unknowns.
  RotationFit mean;
  std::vector<LampCircle> circles;
  /// Number of lamps and heights with three sightings or more that determine no circle.
  int undetermined = 0;
  /// Root of the mean squared distance of the centres from their mean: a symptom of tilt.
  double spread_px = 0;
};

/// The method of Chen and Guan (section 3.1, eq. 9): a circle through the places of each lamp in
/// the undistorted image, and the mean of their centres. On a camera that is tilted by t the centre
/// of what a lamp at angle phi from the axis traces is not at f tan t but at
///   f sin t cos t / (cos^2 t - sin^2 phi),
/// so that the circles disagree, and their mean is too far out. Of eight points or more on a
/// circle, those beyond 4.5 standard deviations are rejected: against the median of the distances,
/// then each against the circle through the others, with Student's t (robust_scatter.h). Needs
/// three sightings of a lamp at a height that determine the centre rather than their noise: those
/// at two opposite yaws do not. A height counts only if most of its circles are determined. Not
/// converged when no height counts. The model is
/// RotationModel::shift.
CircleCenters fit_circle_centers(const SpotCaptures& spot, const Camera& camera);

}  // namespace vlp
