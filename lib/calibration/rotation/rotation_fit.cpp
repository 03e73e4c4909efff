// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_fit.h"

#include <cmath>

namespace vlp {

Tilt compute_tilt(const RotationCenter& center) {
  const Eigen::Vector3d& up = center.zenith_in_camera;
  return {std::atan2(up.head<2>().norm(), up.z()), std::atan2(up.y(), up.x())};
}

std::optional<double> axis_sd_rad(const RotationCenter& center, const Camera& camera) {
  if (!center.covariance) return std::nullopt;
  const Eigen::Vector2d focal_px = camera.focal_px();
  const Eigen::Vector2d variances =
      center.covariance->diagonal().cwiseQuotient(focal_px.cwiseAbs2());
  return std::sqrt(variances.mean());
}

Eigen::Vector2d undistorted_pixel(const Camera& camera, const Eigen::Vector2d& z) {
  const Eigen::Vector2d focal_px = camera.focal_px();
  return focal_px.cwiseProduct(z) + camera.center_px();
}

}  // namespace vlp
