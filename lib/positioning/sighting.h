// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "../geometry/frames.h"
#include "../geometry/plane.h"

/// The positioning equation (Chen and Guan, eq. 1, 3, 6, 7). A level camera is at S = (X, Y, Zs)
/// with yaw g. It observes a lamp at P = (p, Z) at the normalized point z = (x/z, y/z) of its level
/// frame. With points of the floor plane as complex numbers, s = X + jY and H = Z - Zs:
///   p = s + H e^{jg} z      so      z = e^{-jg} (p - s) / H.
namespace vlp {

/// Observation of a lamp of the map by a level camera.
struct Sighting {
  /// Position P of the lamp in the world, m.
  Eigen::Vector3d lamp_m;
  /// Measured point z = (x/z, y/z) in the level frame of the camera.
  Eigen::Vector2d z;
};

/// A pose with e^{jg} in place of g, so that predictions need no trigonometric functions.
struct LevelPose {
  Eigen::Vector3d position_m;
  Eigen::Vector2d heading;

  LevelPose(const Eigen::Vector3d& position, const Eigen::Vector2d& unit_heading)
      : position_m(position), heading(unit_heading) {}
  explicit LevelPose(const Pose& pose)
      : position_m(pose.position_m), heading(std::cos(pose.yaw_rad), std::sin(pose.yaw_rad)) {}
  Pose convert_to_yaw_pose() const { return {position_m, std::atan2(heading.y(), heading.x())}; }
};

/// Returns the height of a lamp above the camera, in m.
inline double lamp_height_above_camera_m(const LevelPose& camera, const Eigen::Vector3d& lamp_m) {
  return lamp_m.z() - camera.position_m.z();
}

/// Computes z of a lamp from a pose.
/// @pre the lamp is above the camera
inline Eigen::Vector2d project_lamp_to_normalized_point(const LevelPose& camera,
                                                        const Eigen::Vector3d& lamp_m) {
  const Eigen::Vector2d offset = (lamp_m - camera.position_m).head<2>();
  return conjugate_product(camera.heading, offset) / lamp_height_above_camera_m(camera, lamp_m);
}

}  // namespace vlp
