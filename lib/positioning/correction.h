// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../rig/calibration.h"

namespace vlp {

/// Parts of a calibration that a fix applies. `all`: every part that exists.
enum class Correction { none, rotation, dispersion, all };

/// Returns the matrix M that applies the correction to rays. A ray v in the camera frame has the
/// direction M v in the level frame. Its normalized point is z = (M v)_xy / (M v)_z.
///
/// M = D R. R is the part of the rotation center (Correction::rotation and all), D that of the
/// dispersion (Correction::dispersion and all). A part that is not selected, or does not exist for
/// `all`, is the identity. f and c are focal length and principal point, px.
///   R, model `tilt`:  the rotation that takes the zenith to +Z;
///   R, model `shift`: the shear that takes z to z - (center_px - c) / f  (eq. 9);
///   D, if there is a rotation center of model `tilt`, selected or not:
///                     the rotation that takes (offset_px / f, 1) to +Z;
///   D otherwise:      the shear that takes z to z - offset_px / f  (eq. 12, 13, with the factor
///                     f / H that they lack).
/// @throws std::invalid_argument if `correction` is rotation or dispersion and that part is
///     missing; if a part, selected or not, has values that are not finite; if the zenith is not in
///     front of the camera
Eigen::Matrix3d compute_level_from_camera_matrix(const Calibration& calibration,
                                                 Correction correction);

}  // namespace vlp
