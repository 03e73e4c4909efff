// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/tilt/drive.h"

namespace vlp {

SyntheticRig make_tilted_rig(double tilt_rad, double azimuth_rad) {
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0, 0, 0}, 0}, {}};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, tilt_rad, azimuth_rad);
  return rig;
}

std::vector<Frame> drive(SyntheticRig rig, int captures, Random& random, double sigma_px) {
  std::vector<Frame> frames;
  for (int i = 0; i < captures; ++i) {
    rig.camera = {{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), i % 2 ? 0.3 : 0.0},
                  random.uniform(-3, 3)};
    frames.push_back({std::to_string(i), seen_from(rig, sigma_px)});
  }
  return frames;
}

}  // namespace vlp
