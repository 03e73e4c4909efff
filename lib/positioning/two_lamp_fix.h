// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../geometry/frames.h"
#include "sighting.h"

namespace vlp {

/// The poses from two lamps: none, one or two.
struct TwoLampPoses {
  int count = 0;
  std::array<Pose, 2> poses;
  /// True if a pose would exist with a lamp at or below the camera's height.
  bool lamp_below_camera = false;
};

/// Computes position and yaw from two lamps in closed form. With D = p_2 - p_1, h = Z_2 - Z_1 and H
/// = Z_1 - Zs, the positioning equation gives D = e^{jg} (H (z_2 - z_1) + h z_2), so
///   |z_2 - z_1|^2 H^2 + 2 h Re(conj(z_2 - z_1) z_2) H + h^2 |z_2|^2 - |D|^2 = 0.
/// At equal heights (h = 0): H = |D| / |z_2 - z_1|, g = arg(D / (z_2 - z_1)), eq. 5 with eq. 7.
///
/// Lamps at different heights have two solutions if both are far from the image center and close
/// together (|h z_2| > |D|); otherwise one. Returns none if the lamps coincide in the image.
TwoLampPoses compute_two_lamp_poses(const Sighting& first, const Sighting& second);

}  // namespace vlp
