// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// A sighting that contradicts the others and was left out of the fit.
struct SpotOutlier {
  /// Index in SpotCaptures::sightings.
  std::size_t sighting;
  /// From where the fit sees it.
  double distance_px;
};

/// A rotation centre as one of the methods finds it.
struct RotationFit {
  /// Otherwise there is nothing below.
  bool converged = false;
  /// Its covariances are for the scatter that the fit found, whatever sigma_px the detections state
  /// (that only weighs them), and for the map's sd_m where the method rests on the map. Without one
  /// if there is no scatter to measure.
  RotationCenter center = {};
  /// Of each capture in SpotCaptures::captures.
  std::vector<double> yaws_rad = {};
  /// Of the image per axis, without the outliers, degrees of freedom taken off: the noise of a
  /// pixel that the fit leaves over, sqrt(sum of squares / (measurements - unknowns)). Zero when as
  /// many are measured as are unknown.
  double residual_px = 0;
  std::vector<SpotOutlier> outliers = {};
  /// Sightings that the centre is computed from, as indices in SpotCaptures::sightings.
  std::vector<std::size_t> used_sightings = {};
};

/// How far a camera leans, and towards where in its image up is: from x to y.
struct Tilt {
  double angle_rad;
  double azimuth_rad;
};
Tilt tilt_of(const RotationCenter& center);

/// Standard deviation of the axis' direction: of the two across it the root of their mean square.
/// Nothing without a covariance.
std::optional<double> axis_sd_rad(const RotationCenter& center, const Camera& camera);

/// A normalized point in the undistorted image: f * z + c.
Eigen::Vector2d undistorted_pixel(const Camera& camera, const Eigen::Vector2d& z);

}  // namespace vlp
