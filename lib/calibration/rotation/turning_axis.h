// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// Lamps at several heights tell a lever arm from a tilt when its standard deviation is below this
/// share of their height over the camera: 0.3 degrees of tilt.
inline constexpr double kLooseLeverArm = 0.005;

/// The direction in the camera about which all lamp rays turn (lib/THEORY.md, "Rotation centre",
/// method `axis`); lens and tilt are exact. Minimizes the squared distances, in the image, of the
/// lamps from
///   project(camera_from_level(zenith) (Rz(-g_k) (p_i - A_h) - e, Z_i - z_h))
/// over the zenith, a yaw g_k per capture, the place p_i of each lamp on the ceiling (the map only
/// says what to start from, so that its errors do not matter; the heights Z_i are the map's), the
/// lever arm e, and, when there are captures at several heights, where the axis stands, A_h, at
/// what height z_h. The scale is the map's: the lamps keep their size as a whole. The covariance
/// has the errors of heights and scale by the map's sd_m.
///
/// A lever arm and a tilt shift the image by zeta - e/H, where H is the height of a lamp over the
/// camera. Captures at several heights tell them apart, and so do, less well, lamps at several
/// heights, by kLeastGap of H. Where all H are alike nothing does but what is of second order in
/// the tilt, which a lens that is a little wrong resembles; then, and when the covariance says that
/// the lamps would tell the lever arm no better than kLooseLeverArm, e is taken as zero: what is
/// found is where the camera sees the point of the ceiling over the axis. A fix that is corrected
/// with it is, at this height, of the axis and not of the camera.
///
/// The model is RotationModel::tilt; center_px is the zenith in the undistorted image.
RotationFit fit_turning_axis(const SpotCaptures& spot, const Camera& camera);

}  // namespace vlp
