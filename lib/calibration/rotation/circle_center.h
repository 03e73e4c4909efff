// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_fit.h"
#include "geometry/circle_fit.h"

namespace vlp {

/// Circle that a lamp traces at one height in the plane of normalized points (x/z, y/z). This plane
/// is the undistorted image in units of the focal length.
struct LampCircle {
  /// Index in RotationCaptures::lamps of the lamp that traces the circle.
  std::size_t lamp;
  /// Index in RotationCaptures::heights of the camera height of the circle.
  std::size_t height;
  CircleFit fit;
};

/// Result of fit_circle_centers().
struct CircleCenters {
  /// Mean of the circle centers. `residual_px` is the RMS distance of the points from their
  /// circles, with three unknowns per circle.
  RotationFit mean;
  std::vector<LampCircle> circles;
  /// Number of (lamp, height) pairs with three observations or more that determine no circle.
  int undetermined = 0;
  /// RMS distance of the centers from their mean, in px. A large value is a symptom of tilt.
  double spread_px = 0;
};

/// Fits a circle to the points of each lamp in the undistorted image and averages the circle
/// centers.
///
/// @return  the mean center with model RotationModel::shift; not converged if no height is used, or
///     if the axis fit has not converged
///
/// The result is biased if the camera is tilted. For a tilt t and a lamp at angle phi from the
/// axis, the center of the lamp's trace is at
///   f sin t cos t / (cos^2 t - sin^2 phi)
/// instead of f tan t. The circles then disagree, and their mean is biased outwards.
///
/// @param axis  fit of fit_rotation_axis(), whose outliers are rejected and whose residuals are the
///     noise, which is at least the given one
///
/// A circle needs three observations of a lamp at one height that determine the center rather than
/// their noise. Observations at two opposite yaws do not determine it. A height is used only if
/// most of its circles are determined.
///
/// Source: Chen and Guan, section 3.1, eq. 9.
CircleCenters fit_circle_centers(const RotationCaptures& rotation, const Camera& camera,
                                 const RotationFit& axis);

}  // namespace vlp
