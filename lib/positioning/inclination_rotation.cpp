// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/inclination_rotation.h"

#include <Eigen/Geometry>
#include <cmath>

#include "geometry/angles.h"

namespace vlp {

InclinationRotation compute_inclination_rotation(const Inclination& inclination,
                                                 double yaw_in_robot_rad) {
  const Eigen::Matrix3d base_from_robot = rotation_about_z(-yaw_in_robot_rad);
  const double pitch_rad = inclination.pitch_rad;
  InclinationRotation rotation;
  rotation.level_from_base =
      base_from_robot * level_rotation_from_inclination(inclination) * base_from_robot.transpose();
  rotation.error_axes.col(0) =
      base_from_robot * Eigen::Vector3d(std::cos(pitch_rad), 0, -std::sin(pitch_rad));
  rotation.error_axes.col(1) = base_from_robot.col(1);
  return rotation;
}

PoseEstimate compute_robot_pose_from_camera_pose(const PoseEstimate& camera,
                                                 const InclinationJacobian& d_pose_d_inclination,
                                                 double inclination_sigma_rad,
                                                 const CameraMount& mount,
                                                 const InclinationRotation& rotation) {
  const Eigen::Matrix3d world_from_level = rotation_about_z(camera.pose.yaw_rad);
  const Eigen::Vector3d arm_in_level = rotation.level_from_base *
                                       rotation_about_z(-mount.yaw_in_robot_rad) *
                                       mount.position_in_robot_m;
  const Eigen::Vector3d arm_in_world = world_from_level * arm_in_level;
  Eigen::Matrix4d d_robot_d_camera = Eigen::Matrix4d::Identity();
  d_robot_d_camera.topRightCorner<2, 1>() << arm_in_world.y(), -arm_in_world.x();
  InclinationJacobian robot_by_lean = d_robot_d_camera * d_pose_d_inclination;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d axis = rotation.error_axes.col(i);
    robot_by_lean.col(i).head<3>() -= world_from_level * axis.cross(arm_in_level);
  }
  robot_by_lean *= inclination_sigma_rad;
  return {{camera.pose.position_m - arm_in_world,
           wrap_angle_rad(camera.pose.yaw_rad - mount.yaw_in_robot_rad)},
          d_robot_d_camera * camera.covariance * d_robot_d_camera.transpose() +
              robot_by_lean * robot_by_lean.transpose()};
}

}  // namespace vlp
