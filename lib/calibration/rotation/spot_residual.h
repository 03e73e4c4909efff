// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// How far a lamp is seen from where a point p of the camera's frame would be, in the image, over
/// sigma_px. To first order in the distance, without the lens: with J the derivative of the pixel
/// at the unit ray v, for which J v = 0,
///   residual = J p / (p . v) / sigma.
struct SpotResidual {
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 2, 3> weighted;

  explicit SpotResidual(const SpotObservation& sighting)
      : ray(sighting.ray), weighted(sighting.d_pixel_d_ray / sighting.sigma_px) {}

  template <typename T>
  void operator()(const Eigen::Matrix<T, 3, 1>& p, T* residual) const {
    // A point to the side or behind is far off; its residual stays finite.
    constexpr double least_cosine = 0.1;
    const T along = p.dot(ray.cast<T>()), least = p.norm() * T(least_cosine);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> at(residual);
    at = weighted.cast<T>() * p / (along > least ? along : least);
  }
};

}  // namespace vlp
