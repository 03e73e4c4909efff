// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/angles.h"
#include "rig/detection.h"

namespace vlp {

double compute_center_sd(const Matrix2& covariance) { return std::sqrt(covariance.trace() / 2); }

std::optional<double> limit_center_sd(double sigma_px) {
  if (!(sigma_px <= kMaxSigma_px)) return std::nullopt;
  return std::max(kMinSigma_px, sigma_px);
}

void add_center_error(double sd_px, Light& light) {
  light.sigma_px = std::min(std::hypot(light.sigma_px, sd_px), kMaxSigma_px);
}

void add_hidden_end_error(double off, double tilt_sd, MeasuredLight& light) {
  constexpr double clear = 3;
  if (!(off > tilt_sd + clear * light.aspect_sd)) return;
  const double length_px =
      std::sqrt(std::numbers::pi * light.aspect) * light.radius_px;  // its area has that radius
  add_center_error(off * length_px / 2 / std::numbers::sqrt2, light);
}

double sd_without_lens_px(const Light& light, const ImageSize& image) {
  constexpr double max_lean_rad = rad_from_deg(10);
  if (light.outline_kind == LightOutline::rectangle) return 0;
  const double focal_px = std::hypot(image.width, image.height) / 2;
  const Eigen::Vector2d middle((image.width - 1) / 2.0, (image.height - 1) / 2.0);
  const double off_axis = (light.pixel - middle).norm() / focal_px;
  const double bound_px =
      light.radius_px * light.radius_px / focal_px * std::hypot(off_axis, std::tan(max_lean_rad));
  return bound_px / std::numbers::sqrt2;
}

}  // namespace vlp
