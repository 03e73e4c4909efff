// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/inclination_rotation.h"

namespace vlp {

Eigen::Matrix3d compute_level_from_base(const Inclination& inclination, double yaw_in_robot_rad) {
  const Eigen::Matrix3d base_from_robot = rotation_about_z(-yaw_in_robot_rad);
  return base_from_robot * level_rotation_from_inclination(inclination) *
         base_from_robot.transpose();
}

}  // namespace vlp
