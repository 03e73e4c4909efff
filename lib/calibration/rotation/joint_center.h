// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// One centre of rotation for all lamps in the undistorted image (lib/THEORY.md, "Rotation centre",
/// method `joint`): the circles of eq. 9 with an angle per capture that all lamps share. Minimizes
/// the squared distances, in the image, of the lamps from
///   z_ik = c + e^{-jg_k} q_ih
/// over the centre c, the angles, and a place q of each lamp at each height. Exact for a level
/// camera and captures at one height; on a tilted one c is too far out, as for `circle`
/// (circle_center.h). The model is RotationModel::shift.
RotationFit fit_joint_center(const SpotCaptures& spot, const Camera& camera);

}  // namespace vlp
