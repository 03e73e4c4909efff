// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/inclination_rotation.h"

#include <cmath>

namespace vlp {

InclinationRotation compute_inclination_rotation(const Inclination& inclination,
                                                 double yaw_in_robot_rad) {
  const Eigen::Matrix3d base_from_robot = rotation_about_z(-yaw_in_robot_rad);
  const double pitch_rad = inclination.pitch_rad;
  InclinationRotation lean;
  lean.level_from_base =
      base_from_robot * level_from_inclination(inclination) * base_from_robot.transpose();
  lean.error_axes.col(0) =
      base_from_robot * Eigen::Vector3d(std::cos(pitch_rad), 0, -std::sin(pitch_rad));
  lean.error_axes.col(1) = base_from_robot.col(1);
  return lean;
}

}  // namespace vlp
