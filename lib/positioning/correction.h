// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../rig/calibration.h"

namespace vlp {

/// Which parts of a calibration a fix applies. `all` is every part that is there.
enum class Correction { none, rotation, dispersion, all };

/// The correction as one matrix M: a ray v of the camera is seen along M v in the level frame,
/// at the normalized point z = (M v)_xy / (M v)_z. M is the product of
///   rotation centre, `tilt`:  the rotation that takes the zenith to +Z;
///   rotation centre, `shift`: the shear that takes z to z - (center_px - c) / f  (eq. 9);
///   dispersion after `tilt`:  the rotation that takes (offset_px / f, 1) to +Z;
///   dispersion otherwise:     the shear that takes z to z - offset_px / f  (eq. 12, 13, with the
///                             factor f / H that they lack).
/// Throws std::invalid_argument when `correction` asks for a part that is not there, or a part
/// holds what is not finite or a zenith that is not in front of the camera.
Eigen::Matrix3d level_from_camera(const Calibration& calibration, Correction correction);

}  // namespace vlp
