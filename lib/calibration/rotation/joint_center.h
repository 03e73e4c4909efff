// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_fit.h"

namespace vlp {

/// Fits one rotation center for all lamps in the undistorted image (lib/THEORY.md, "Rotation
/// center", method `joint`). The model is that of eq. 9 with one angle per capture that all lamps
/// share.
///
/// Minimizes the distances of the lamps in the image, in standard deviations, with a Cauchy loss
/// and rejection of outliers (robust_fit.h), from
///   z_ik = c + e^{-jg_k} q_ih
/// over
///   c     center
///   g_k   yaw of capture k
///   q_ih  position of lamp i about the center, at height h and yaw 0
///
/// Exact for a level camera and captures at one height. If the camera is tilted, c is biased
/// outwards as in fit_circle_centers(). The model of the result is RotationModel::shift.
RotationFit fit_joint_center(const RotationCaptures& rotation, const Camera& camera);

}  // namespace vlp
