// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/pixel_rays.h"

#include <limits>

namespace vlp {

PixelRays::PixelRays(const Camera& camera, int margin_px)
    : lens_(camera.lens_model, camera.intrinsics),
      readout_(camera.readout.value()),
      lines_(camera.imager_px[readout_ == Readout::rows ? 1 : 0]),
      places_(camera.imager_px[readout_ == Readout::rows ? 0 : 1]),
      margin_px_(margin_px),
      stride_(static_cast<std::size_t>(places_ + 2 * margin_px + 1)) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  corners_.reserve(static_cast<std::size_t>(lines_ + 2 * margin_px + 1) * stride_);
  for (int line = -margin_px; line <= lines_ + margin_px; ++line) {
    for (int place = -margin_px; place <= places_ + margin_px; ++place) {
      const Eigen::Vector2d line_and_place(line - 0.5, place - 0.5);
      const Eigen::Vector2d pixel =
          readout_ == Readout::rows ? Eigen::Vector2d(line_and_place.reverse()) : line_and_place;
      const auto ray = lens_.unproject_pixel(pixel);
      corners_.push_back(ray ? ray->direction : Eigen::Vector3d::Constant(nan));
    }
  }
}

}  // namespace vlp
