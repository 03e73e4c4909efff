// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_fit.h"

namespace vlp {

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
/// Minimizes the squared distances of the lamps, in the image, from
///   project(camera_from_level(zenith) (Rz(-g_k) (p_i - A_h) - e, Z_i - z_h))
/// over
///   zenith    up direction in the camera
///   g_k       yaw of capture k
///   p_i       horizontal position of lamp i
///   e         lever arm
///   A_h, z_h  position of the axis and height of the camera, for captures at several heights
/// The heights Z_i are those of the map. The map supplies only initial values of p_i, so that its
/// horizontal errors have no effect. The scale is that of the map: the size of the lamp pattern is
/// kept. The covariance includes errors of heights and scale by the map's sd_m.
///
/// A lever arm and a tilt both displace the image, by zeta - e/H, where H is the height of a lamp
/// above the camera. Captures at several heights separate them. Lamps whose heights differ by
/// kMinHeightGapFraction of H or more also separate them, with less precision. With a single H only
/// second-order effects of the tilt do, which a small lens error resembles.
///
/// The lever arm is set to zero if there is a single H, or if its standard deviation would exceed
/// kMaxLeverArmSdFraction. The result is then the image of the ceiling point above the axis. At
/// this height, a fix that is corrected with it is the position of the axis instead of the camera.
RotationFit fit_rotation_axis(const RotationCaptures& rotation, const Camera& camera);

}  // namespace vlp
