// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// The direction in the camera about which all lamp rays turn (theory, "Rotation centre", method
/// `axis`); lens and tilt are exact. Minimizes the squared distances, in the image, of the lamps
/// from
///   project(camera_from_level(zenith) (Rz(-g_k) (p_i - A_h) - e, Z_i - z_h))
/// over the zenith, a yaw g_k per capture, the place p_i of each lamp on the ceiling (the map only
/// says what to start from, so that its errors do not matter; the heights Z_i are the map's), and,
/// when there are captures at several heights, the lever arm e and where the axis stands, A_h, at
/// what height z_h. The scale is then the map's: the lamps keep their size as a whole.
///
/// At one height a lever arm and a tilt shift the image alike, by zeta - e/H, and cannot be told
/// apart. There e is taken as zero: what is found is where the camera sees the point of the ceiling
/// over the axis. A fix that is corrected with it is, at this height, of the axis and not of the
/// camera.
///
/// The model is RotationModel::tilt; center_px is the zenith in the undistorted image.
RotationFit fit_turning_axis(const SpotCaptures& spot, const Camera& camera);

}  // namespace vlp
