// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../geometry/frames.h"
#include "sighting.h"

namespace vlp {

/// The poses that see two lamps where they are seen: none, one or two.
struct TwoLampFix {
  int count = 0;
  std::array<Pose, 2> poses;
  /// A pose would exist if a lamp could stand at or below the camera's height.
  bool lamp_below_camera = false;
};

/// Position and yaw from two lamps, in closed form. With D = p_2 - p_1, h = Z_2 - Z_1 and
/// H = Z_1 - Zs, the positioning equation gives D = e^{jg} (H (z_2 - z_1) + h z_2), so
///   |z_2 - z_1|^2 H^2 + 2 h Re(conj(z_2 - z_1) z_2) H + h^2 |z_2|^2 - |D|^2 = 0.
/// At equal heights (h = 0) that is H = |D| / |z_2 - z_1|, g = arg(D / (z_2 - z_1)), eq. 5 with
/// eq. 7. Lamps at different heights have two solutions when both are seen far to one side and
/// close together, as |h z_2| > |D| says; otherwise one. None when the two are seen as one.
TwoLampFix fix_two_lamps(const Sighting& first, const Sighting& second);

}  // namespace vlp
