// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"
#include "../geometry/plane.h"
#include "../geometry/types.h"

/// The positioning equation (Chen and Guan, eq. 1, 3, 6, 7). A level camera is at S = (X, Y, Zs)
/// with yaw g. It observes a lamp at P = (p, Z) at the normalized point z = (x/z, y/z) of its level
/// frame. With points of the floor plane as complex numbers, s = X + jY and H = Z - Zs:
///   p = s + H e^{jg} z      so      z = e^{-jg} (p - s) / H.
namespace vlp {

/// Observation of a lamp of the map by a level camera: position P of the lamp in the world, m,
/// measured normalized point z in the level frame, and noise of its pixel. In the positioning
/// equation p = s + H e^{jg} z, p is the lamp and s the camera, both in the floor plane, H the
/// height of the lamp above the camera, and g the camera's yaw.
struct Sighting {
  /// Position P of the lamp in the world, m.
  Eigen::Vector3d lamp_m;
  /// Measured point z = (x/z, y/z) in the level frame of the camera.
  Eigen::Vector2d z;
  /// Derivative of the pixel, px, with respect to z. Converts residuals of z to pixels, in which
  /// the noise is given.
  Matrix2 d_pixel_d_z;
  /// Standard deviation of the lamp's pixel per axis.
  double sigma_px;
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

/// Normalized point z of a lamp, predicted from a pose, with its derivative.
struct Prediction {
  Eigen::Vector2d z;
  /// Derivative of z with respect to the state (X, Y, Zs, g), in m and rad.
  Eigen::Matrix<double, 2, 4> d_z_d_state;
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

/// Computes z of a lamp from a pose, and its derivatives.
/// @pre the lamp is above the camera
inline Prediction project_lamp_with_jacobian(const LevelPose& camera,
                                             const Eigen::Vector3d& lamp_m) {
  const double inverse_height = 1 / lamp_height_above_camera_m(camera, lamp_m);
  const double c = camera.heading.x() * inverse_height, s = camera.heading.y() * inverse_height;
  const Eigen::Vector2d z = project_lamp_to_normalized_point(camera, lamp_m);
  Prediction prediction{z, {}};
  prediction.d_z_d_state << -c, -s, z.x() * inverse_height, z.y(),  //
      s, -c, z.y() * inverse_height, -z.x();
  return prediction;
}

/// Returns the derivative of z with respect to a small rotation of the level frame about its x and
/// y axes, rad.
inline Eigen::Matrix2d compute_normalized_point_jacobian_wrt_tilt(const Eigen::Vector2d& z) {
  Eigen::Matrix2d jacobian;
  jacobian << -z.x() * z.y(), 1 + z.x() * z.x(), -(1 + z.y() * z.y()), z.x() * z.y();
  return jacobian;
}

}  // namespace vlp
