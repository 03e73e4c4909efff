// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/fit_parts.h"

#include <cmath>

namespace vlp {

RotationCenter make_rotation_center(const Eigen::Vector2d& z, RotationModel model,
                                    const Camera& camera,
                                    const std::optional<Matrix2>& covariance) {
  const Eigen::Vector2d focal_px = camera.focal_px();
  RotationCenter center;
  center.model = model;
  center.center_px = undistorted_pixel(camera, z);
  center.zenith_in_camera = z.homogeneous().normalized();
  if (covariance) {
    center.covariance = covariance->cwiseProduct((focal_px * focal_px.transpose()).eval());
  }
  return center;
}

std::vector<double> collect_yaws(const RotationCaptures& rotation) {
  std::vector<double> yaws_rad;
  yaws_rad.reserve(rotation.captures.size());
  for (const RotationCapture& capture : rotation.captures) yaws_rad.push_back(capture.yaw_rad);
  return yaws_rad;
}

std::vector<const double*> pointers_to(const std::vector<double>& values) {
  std::vector<const double*> pointers;
  pointers.reserve(values.size());
  for (const double& value : values) pointers.push_back(&value);
  return pointers;
}

void set_statistics(RotationFit& result, const RobustFit& fit, const RotationCaptures& rotation) {
  std::vector<bool> out(rotation.observations.size(), false);
  for (const std::size_t i : fit.outliers()) {
    out[i] = true;
    result.outliers.push_back({i, fit.lengths()[i] * rotation.observations[i].sigma_px});
  }
  double squares = 0;
  result.used_observations.reserve(out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i]) continue;
    result.used_observations.push_back(i);
    squares += std::pow(fit.lengths()[i] * rotation.observations[i].sigma_px, 2);
  }
  const int freedom = fit.degrees_of_freedom();
  result.residual_px = freedom > 0 ? std::sqrt(squares / freedom) : 0;
}

}  // namespace vlp
