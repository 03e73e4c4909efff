// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "lean.h"

namespace vlp {

/// How the camera sits on the robot. The robot's frame has z up at its centre; the camera stands at
/// `position_in_robot_m`, its yaw turned by `yaw_in_robot_rad` against the robot's.
struct CameraMount {
  Eigen::Vector3d position_in_robot_m;
  double yaw_in_robot_rad;
};

/// A pose and the covariance of its (X, Y, Z, yaw) in metres and radians.
struct PoseEstimate {
  Pose pose;
  Matrix4 covariance;
};

/// What an error of the inclination's roll, and one of its pitch, does to (X, Y, Z, yaw).
using LeanEffect = Eigen::Matrix<double, 4, 2>;

/// The robot's centre and yaw from the camera's: with m the mount's position turned into the
/// camera's level frame, leaning as the robot does,
///   robot = S - Rz(g) m,   yaw = g - yaw_in_robot.
/// `camera` has the covariance of the pixel noise; `by_lean` is how it errs with the inclination,
/// and m errs with it, too.
PoseEstimate robot_from_camera(const PoseEstimate& camera, const LeanEffect& by_lean,
                               double inclination_sigma_rad, const CameraMount& mount,
                               const Lean& lean);

}  // namespace vlp
