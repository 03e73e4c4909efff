// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/ceres.h>

#include <memory>

#include "calibration/rotation/spot_residual.h"

namespace vlp {

/// The residual of fit_turning_axis(). Parameters: the zenith's normalized point in the camera (2),
/// the lever arm (2), the lamp's place on the ceiling (2), the axis and the height of the camera
/// (3), the yaw (1); all in the world but the first two.
struct AxisResidual {
  SpotResidual in_image;
  double lamp_z_m;

  template <typename T>
  bool operator()(const T* zenith, const T* lever_arm_m, const T* lamp_m, const T* axis_m,
                  const T* yaw_rad, T* residual) const {
    using std::cos, std::sin, std::sqrt;
    const T x = lamp_m[0] - axis_m[0], y = lamp_m[1] - axis_m[1];
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> in_level(c * x + s * y - lever_arm_m[0],
                                          c * y - s * x - lever_arm_m[1], lamp_z_m - axis_m[2]);
    // camera_from_level: the transpose of level_from_zenith(), the smallest turn of n to +Z.
    const T nz = 1.0 / sqrt(1.0 + zenith[0] * zenith[0] + zenith[1] * zenith[1]);
    const Eigen::Matrix<T, 3, 1> n(zenith[0] * nz, zenith[1] * nz, nz);
    const T across = (n[0] * in_level[0] + n[1] * in_level[1]) / (1.0 + nz);
    const T lift = in_level[2] - across;
    const Eigen::Matrix<T, 3, 1> in_camera(in_level[0] + n[0] * lift, in_level[1] + n[1] * lift,
                                           nz * in_level[2] - across * (1.0 + nz));
    in_image(in_camera, residual);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const SpotSighting& sighting,
                                                     double lamp_z_m) {
    return std::make_unique<ceres::AutoDiffCostFunction<AxisResidual, 2, 2, 2, 2, 3, 1>>(
        new AxisResidual{SpotResidual(sighting), lamp_z_m});
  }
};

}  // namespace vlp
