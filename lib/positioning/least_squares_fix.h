// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "sighting.h"

namespace vlp {

/// Least-squares pose with covariance and statistics of the residuals.
struct LeastSquaresFix {
  Pose pose;
  /// Covariance of (X, Y, Zs, g), in m and rad: position of the camera in the world, with its
  /// height Zs, and yaw g. It is (J^T W J)^-1 for the sigma_px of the pixels, not scaled by the
  /// residuals.
  Matrix4 covariance;
  /// Sum of the squared pixel residuals over sigma_px^2; 2n - 4 degrees of freedom.
  double chi_squared;
  /// RMS distance in the image between the observed and the predicted lamps.
  double residual_px;
};

/// Estimates the pose of a level camera from two or more lamps at any heights by least squares.
/// Minimizes
///   sum |d_pixel_d_z (z - e^{-jg} (p - s) / H)|^2 / sigma_px^2
/// over (X, Y, Zs, g). Each lamp is weighted by its sigma_px and by the local mapping of the lens.
/// Gauss-Newton from `start`; a step that does not reduce the sum of squares is halved.
///
/// Returns std::nullopt if a lamp is not above `start`, if the lamps do not determine the state, or
/// without convergence in 50 steps.
std::optional<LeastSquaresFix> estimate_pose_least_squares(std::span<const Sighting> sightings,
                                                           const Pose& start);

}  // namespace vlp
