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
/// M is the product of the following parts; the identity for Correction::none:
///   rotation center, `tilt`:  the rotation that takes the zenith to +Z;
///   rotation center, `shift`: the shear that takes z to z - (center_px - c) / f  (eq. 9);
///   dispersion after `tilt`:  the rotation that takes (offset_px / f, 1) to +Z;
///   dispersion otherwise:     the shear that takes z to z - offset_px / f  (eq. 12, 13, with the
///                             factor f / H that they lack).
/// @throws std::invalid_argument if `correction` requires a part that is missing; if a part has
///     values that are not finite; if the zenith is not in front of the camera
Eigen::Matrix3d compute_level_from_camera_matrix(const Calibration& calibration,
                                                 Correction correction);

}  // namespace vlp
