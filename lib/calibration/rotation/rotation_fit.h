// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// Observation that contradicts the other observations and is rejected.
struct RotationOutlier {
  /// Index in RotationCaptures::sightings.
  std::size_t observation;
  /// Distance from the position that the fit predicts, in px.
  double distance_px;
};

/// Rotation center that one of the methods found.
struct RotationFit {
  /// If false, the other members are not valid.
  bool converged = false;
  /// Rotation center with its covariances. They are scaled by the residuals of the fit; sigma_px of
  /// the detections only sets relative weights. They include the map's sd_m if the method depends
  /// on the map. There is no covariance if the fit has no redundancy.
  RotationCenter center = {};
  /// Yaw of each capture, rad, in the order of RotationCaptures::captures.
  std::vector<double> yaws_rad = {};
  /// RMS residual of the inliers per image axis, in px: sqrt(sum of squares / (measurements -
  /// unknowns)). It estimates the pixel noise. It is 0 if there are as many measurements as
  /// unknowns.
  double residual_px = 0;
  std::vector<RotationOutlier> outliers = {};
  /// Observations that determine the center, as indices in RotationCaptures::sightings.
  std::vector<std::size_t> used_observations = {};
};

/// Tilt of a camera. The azimuth is the direction of "up" in the image, from x to y.
struct Tilt {
  double angle_rad;
  double azimuth_rad;
};
/// Returns the tilt that the zenith of `center` corresponds to.
Tilt compute_tilt(const RotationCenter& center);

/// Returns the standard deviation of the axis direction, rad: the RMS over the two directions
/// across it. Returns std::nullopt if `center` has no covariance.
std::optional<double> axis_sd_rad(const RotationCenter& center, const Camera& camera);

/// Returns the pixel f * z + c of a normalized point in the undistorted image.
Eigen::Vector2d undistorted_pixel(const Camera& camera, const Eigen::Vector2d& z);

}  // namespace vlp
