// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "rig/lamp_map.h"
#include "session/step_result.h"

namespace vlp {

/// Where the fix of a capture has its camera, and sees lamps, on the ceiling in the world.
struct CeilingView {
  struct SeenLamp {
    int lamp;
    Eigen::Vector2d seen_m;
    double above_camera_m;
  };
  Eigen::Vector2d camera_m;
  /// Each once.
  std::vector<SeenLamp> lamps;
};

/// Where the other lamps see each lamp, by all captures together. A fix that rests on a lamp which
/// was moved is wrong itself, and in a capture that sees other lamps otherwise. So the lamps'
/// displacements x and what each fix c leaves open, y_c (place, yaw and height), are solved for:
///   sum over c |seen_c - map_c - x_c - A_c y_c|^2 -> min,   G' x = 0,
/// A_c: how what the camera has in common moves what it sees; G: the similarities of the floor
/// plan, which no capture tells of. Then a lamp's offset is what the similarity that fits the
/// others best leaves of it: its movement, exactly, when it alone was moved. What contradicts the
/// rest by 6 standard deviations or so, as a misidentified lamp, is left out. Of lamps that two
/// captures or more see beside two others or more; none where captures do not tie all of them
/// together, or nothing is over to tell the noise. Lamps hang much alike high.
std::vector<LampOffset> offsets_of_lamps(const LampMap& map, std::vector<CeilingView> views);

}  // namespace vlp
