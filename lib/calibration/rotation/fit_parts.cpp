// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/fit_parts.h"

#include <cmath>

namespace vlp {

RotationCenter rotation_center_at(const Eigen::Vector2d& z, RotationModel model,
                                  const Camera& camera, const std::optional<Matrix2>& covariance) {
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

std::vector<double> yaws_of(const SpotCaptures& spot) {
  std::vector<double> yaws_rad;
  yaws_rad.reserve(spot.captures.size());
  for (const SpotCapture& capture : spot.captures) yaws_rad.push_back(capture.yaw_rad);
  return yaws_rad;
}

std::vector<const double*> pointers_to(const std::vector<double>& values) {
  std::vector<const double*> pointers;
  pointers.reserve(values.size());
  for (const double& value : values) pointers.push_back(&value);
  return pointers;
}

void describe(RotationFit& result, const RobustFit& fit, const SpotCaptures& spot) {
  std::vector<bool> out(spot.sightings.size(), false);
  for (const std::size_t i : fit.outliers()) {
    out[i] = true;
    result.outliers.push_back({i, fit.lengths()[i] * spot.sightings[i].sigma_px});
  }
  double squares = 0;
  result.used_sightings.reserve(out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i]) continue;
    result.used_sightings.push_back(i);
    squares += std::pow(fit.lengths()[i] * spot.sightings[i].sigma_px, 2);
  }
  const int freedom = fit.degrees_of_freedom();
  result.residual_px = freedom > 0 ? std::sqrt(squares / freedom) : 0;
}

}  // namespace vlp
