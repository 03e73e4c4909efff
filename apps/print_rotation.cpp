// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "print_rotation.h"

#include <fmt/core.h>

#include "calibration/rotation/rotation_fit.h"
#include "geometry/angles.h"

namespace vlp {

std::string sd_of(const std::optional<Matrix2>& covariance, double factor, const char* unit) {
  if (!covariance) return ", sd not known";
  const Eigen::Vector2d sd = factor * covariance->diagonal().cwiseSqrt();
  return fmt::format(", sd {:.4f} {:.4f} {}", sd.x(), sd.y(), unit);
}

void print_center(const RotationCenter& center, const Camera& camera) {
  fmt::print("centre      {:.3f} {:.3f} px in the undistorted image{}\n", center.center_px.x(),
             center.center_px.y(), sd_of(center.covariance, 1, "px"));
  const Eigen::Vector3d& up = center.zenith_in_camera;
  fmt::print("zenith      {:.6f} {:.6f} {:.6f} in the camera\n", up.x(), up.y(), up.z());
  const auto [angle_rad, azimuth_rad] = tilt_of(center);
  const auto sd_rad = axis_sd_rad(center, camera);
  fmt::print("tilt        {:.4f} deg towards {:.1f} deg in the image{}\n", deg_from_rad(angle_rad),
             deg_from_rad(azimuth_rad),
             sd_rad ? fmt::format(", sd {:.4f} deg", deg_from_rad(*sd_rad)) : "");
}

}  // namespace vlp
