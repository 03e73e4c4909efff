// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "../geometry/frames.h"
#include "known_motion.h"
#include "robot.h"
#include "sighting.h"

namespace vlp {

/// Motion of the camera at the readout time of the lamp's row.
struct MotionAtReadout {
  /// Motion along the axes of the camera's level frame.
  KnownMotion motion = {};
  /// Position of the camera relative to the center of rotation, along the same axes.
  Eigen::Vector2d arm_m{0, 0};
  /// Time from the middle of the image to the readout of the row.
  double time_s = 0;
};

/// Computes the position from one lamp if height and yaw are known (eq. 6 solved for s):
///   s = p - e^{jg} (H e^{jwt} z + (e^{jwt} - 1) a + u t)
///   u, w  velocity and yaw rate;   a  arm;   t  time of the readout
/// Returns std::nullopt if the lamp is not above the camera.
std::optional<Pose> compute_pose_at_known_height_and_yaw(const Sighting& sighting,
                                                         const HeightAndYaw& known,
                                                         const MotionAtReadout& readout = {});

/// Returns the covariance of (X, Y, Zs, g) from the pixel noise alone.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Matrix4 compute_one_lamp_covariance(const Sighting& sighting, const Pose& pose);

/// Returns the covariance of (X, Y, Zs, g) from the errors of height, yaw and motion.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Matrix4 compute_one_lamp_sensor_covariance(const Sighting& sighting, const Pose& pose,
                                           const HeightAndYaw& known,
                                           const MotionAtReadout& readout);

/// Returns the derivative of (X, Y, Zs, g) by a small rotation of the level frame about each of its
/// axes.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Eigen::Matrix<double, 4, 3> compute_one_lamp_rotation_jacobian(const Sighting& sighting,
                                                               const Pose& pose);

}  // namespace vlp
