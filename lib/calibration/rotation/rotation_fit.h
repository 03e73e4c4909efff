// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "calibration/rotation/rotation_captures.h"
#include "rig/calibration.h"

namespace vlp {

/// Observation that contradicts the other observations and is rejected.
struct RotationOutlier {
  /// Index in RotationCaptures::observations of the rejected observation.
  std::size_t observation;
  /// Distance from the position that the fit predicts, in px; infinite if the lens does not image
  /// the lamp.
  double distance_px;
};

/// Rotation center estimated by one of the methods, with residuals and outliers.
struct RotationFit {
  /// True if the fit succeeded; otherwise the other members are not valid.
  bool converged = false;
  RotationCenter center = {};
  /// Covariance of the zenith's normalized point (x/z, y/z) and, if there is one, of the lever arm
  /// in m, with an exact lens. It includes the map's sd_m if the method depends on the map.
  /// `circle`: it follows from the residuals; there is none without redundancy.
  std::optional<MatrixX> covariance = {};
  /// Method `axis`, if the covariance of the lens is known: joint covariance of intrinsics, zenith
  /// and lever arm.
  std::optional<MatrixX> joint_covariance = {};
  /// RMS residual of the inliers per image axis, in px: sqrt(sum of squares / (measurements -
  /// unknowns)). It estimates the pixel noise. It is 0 if there are as many measurements as
  /// unknowns.
  double residual_px = 0;
  std::vector<RotationOutlier> outliers = {};
  /// Observations that determine the center, as indices in RotationCaptures::observations.
  std::vector<std::size_t> used_observations = {};
};

/// Tilt of a camera. The azimuth is the direction of "up" in the image, from x to y.
struct Tilt {
  double angle_rad;
  double azimuth_rad;
};
/// Returns the tilt that the zenith of `center` corresponds to.
Tilt compute_tilt(const RotationCenter& center);

/// Returns the pixel f * z + c of a normalized point in the undistorted image.
Eigen::Vector2d ideal_pixel_from_point(const Camera& camera, const Eigen::Vector2d& z);

/// Returns the rotation center whose axis appears at normalized point z in the camera.
RotationCenter make_rotation_center(const Eigen::Vector2d& z, RotationModel model,
                                    const Camera& camera);

/// Largest standard deviation of a lever arm that lamps at several heights determine, as a fraction
/// of the lamps' height above the camera. It corresponds to 0.3 degrees of tilt.
inline constexpr double kMaxLeverArmSdFraction = 0.005;

/// Fits the direction in the camera about which all lamp rays rotate (lib/THEORY.md, "Rotation
/// center", method `axis`). The model is exact in lens and tilt.
///
/// @return  the rotation center with model RotationModel::tilt; `center_px` is the zenith in the
///     undistorted image. Not converged if the RMS residual exceeds 0.007 focal lengths and four
///     times RotationCaptures::median_sigma_px: the captures are then no rotation about one axis.
///
/// A preset of adjust_bundle() that holds the lens, with MapPrior::heights: minimizes the
/// squared distances of the lamps, in the image, from
///   project(camera_from_level(zenith) (Rz(-g_k) (p_i - A_h) - e, Z_i - z_h))
/// over
///   zenith    up direction in the camera
///   g_k       yaw of capture k
///   p_i, Z_i  horizontal position and height of lamp i
///   e         lever arm
///   A_h, z_h  position of the axis and height of the camera at height h
/// Horizontal errors of the map have no effect, except for one of its scale. Heights and scale have
/// the errors that follow from sd_m. The noise of the detections is at least the stated one.
///
/// A lever arm and a tilt both displace the image, by zeta - e/H, where H is the height of a lamp
/// above the camera. Captures at several heights separate them. Lamps whose heights differ by
/// kMinHeightGapFraction of H or more also separate them, with less precision. With a single H only
/// second-order effects of the tilt do, which a small lens error resembles.
///
/// The lever arm is set to zero if there is a single H, or if its standard deviation would exceed
/// kMaxLeverArmSdFraction. The result is then the image of the ceiling point above the axis. At
/// this height, a fix that is corrected with it is the position of the axis instead of the camera.
///
/// @param lens_covariance  IntrinsicsReport::covariance
RotationFit fit_rotation_axis(const RotationCaptures& rotation, const Camera& camera,
                              const std::optional<MatrixX>& lens_covariance = {});

}  // namespace vlp
