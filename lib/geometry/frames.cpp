// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/frames.h"

#include <Eigen/Geometry>
#include <cassert>

namespace vlp {

Eigen::Matrix3d rotation_about_z(double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Eigen::Matrix3d level_rotation_from_inclination(const Inclination& inclination) {
  return (Eigen::AngleAxisd(inclination.pitch_rad, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(inclination.roll_rad, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Matrix3d level_rotation_from_zenith(const Eigen::Vector3d& zenith_in_camera) {
  const Eigen::Vector3d up = zenith_in_camera.normalized();
  assert(up.z() > -1);
  // Rodrigues' formula for the rotation u -> e_z, free of trigonometry: the axis times the sine
  // is u x e_z = (u_y, -u_x, 0) and the cosine is u_z.
  const double k = 1.0 / (1.0 + up.z());
  Eigen::Matrix3d level_from_camera;
  level_from_camera << 1 - k * up.x() * up.x(), -k * up.x() * up.y(), -up.x(),  //
      -k * up.x() * up.y(), 1 - k * up.y() * up.y(), -up.y(),                   //
      up.x(), up.y(), up.z();
  return level_from_camera;
}

Eigen::Vector3d level_point_from_world(const Pose& level, const Eigen::Vector3d& x_in_world) {
  return rotation_about_z(level.yaw_rad).transpose() * (x_in_world - level.position_m);
}

}  // namespace vlp
