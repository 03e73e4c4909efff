// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/one_lamp_fix.h"

#include <Eigen/LU>

namespace vlp {

std::optional<Pose> fix_one_lamp(const Sighting& sighting, const HeightAndYaw& known) {
  const double height_m = sighting.lamp_m.z() - known.z_m;
  if (!(height_m > 0)) return std::nullopt;
  const LevelPose above({0, 0, known.z_m}, {std::cos(known.yaw_rad), std::sin(known.yaw_rad)});
  const Eigen::Vector2d s =
      sighting.lamp_m.head<2>() - height_m * complex_product(above.heading, sighting.z);
  return Pose{{s.x(), s.y(), known.z_m}, known.yaw_rad};
}

Matrix4 one_lamp_covariance(const Sighting& sighting, const Pose& pose) {
  const Eigen::Matrix2d d_pixel_d_xy =
      sighting.d_pixel_d_z * predict(LevelPose(pose), sighting.lamp_m).d_z_d_state.leftCols<2>();
  const Eigen::Matrix2d d_xy_d_pixel = d_pixel_d_xy.inverse();
  Matrix4 covariance = Matrix4::Zero();
  covariance.topLeftCorner<2, 2>() =
      sighting.sigma_px * sighting.sigma_px * d_xy_d_pixel * d_xy_d_pixel.transpose();
  return covariance;
}

Eigen::Matrix<double, 4, 3> one_lamp_rotation_effect(const Sighting& sighting, const Pose& pose) {
  Eigen::Matrix<double, 2, 3> d_z;
  d_z << tilt_jacobian(sighting.z), Eigen::Vector2d(-sighting.z.y(), sighting.z.x());
  const LevelPose camera(pose);
  Eigen::Matrix<double, 4, 3> effect = Eigen::Matrix<double, 4, 3>::Zero();
  effect.topRows<2>() =
      -height_above(camera, sighting.lamp_m) * product_matrix(camera.heading) * d_z;
  return effect;
}

}  // namespace vlp
