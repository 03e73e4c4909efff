// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/unknown_lens.h"

#include <cmath>
#include <numbers>

#include "geometry/angles.h"

namespace vlp {

double predict_center_sd_without_lens_px(const Light& light, const ImageSize& image) {
  constexpr double max_lean_rad = rad_from_deg(10);
  if (light.shape == ShapeKind::rectangle) return 0;
  const double focal_px = std::hypot(image.width, image.height) / 2;
  const Eigen::Vector2d middle((image.width - 1) / 2.0, (image.height - 1) / 2.0);
  const double off_axis = (light.pixel - middle).norm() / focal_px;
  const double bound_px =
      light.radius_px * light.radius_px / focal_px * std::hypot(off_axis, std::tan(max_lean_rad));
  return bound_px / std::numbers::sqrt2;
}

}  // namespace vlp
