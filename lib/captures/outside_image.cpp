// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/outside_image.h"

namespace vlp {

std::size_t count_far_outside(std::span<const Frame> frames, const std::array<int, 2>& imager_px) {
  constexpr double fraction = 0.1;
  const Eigen::Array2d size(imager_px[0], imager_px[1]);
  std::size_t outside = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      const Eigen::Array2d pixel = detection.pixel.array();
      const bool near = (pixel >= -fraction * size).all() && (pixel <= (1 + fraction) * size).all();
      outside += near ? 0 : 1;
    }
  }
  return outside;
}

}  // namespace vlp
