// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/rotation/rotation_captures.h"

namespace vlp {

/// Residual of a lamp observation in the image, divided by sigma_px.
///
/// For a lamp at point p in the camera frame, observed along the unit ray v, to first order in the
/// distance and without evaluating the lens:
///   residual = J p / (p . v) / sigma
/// J is the derivative of the pixel at v, with J v = 0.
struct RotationResidual {
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 2, 3> weighted;

  explicit RotationResidual(const RotationObservation& observation)
      : ray(observation.ray), weighted(observation.d_pixel_d_ray / observation.sigma_px) {}

  template <typename T>
  void operator()(const Eigen::Matrix<T, 3, 1>& p, T* residual) const {
    // Keeps the residual finite for points to the side or behind the camera.
    constexpr double min_cosine = 0.1;
    const T along = p.dot(ray.cast<T>()), min_along = p.norm() * T(min_cosine);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> at(residual);
    at = weighted.cast<T>() * p / (along > min_along ? along : min_along);
  }
};

}  // namespace vlp
