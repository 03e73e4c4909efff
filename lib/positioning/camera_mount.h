// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "fix.h"
#include "inclination_rotation.h"
#include "robot.h"

namespace vlp {

/// What an error of the inclination's roll, and one of its pitch, does to (X, Y, Z, yaw).
using InclinationJacobian = Eigen::Matrix<double, 4, 2>;

/// The robot's centre and yaw from the camera's: with m the mount's position turned into the
/// camera's level frame, leaning as the robot does,
///   robot = S - Rz(g) m,   yaw = g - yaw_in_robot.
/// `camera` has the covariance of the pixel noise; `by_lean` is how it errs with the inclination,
/// and m errs with it, too.
PoseEstimate robot_from_camera(const PoseEstimate& camera, const InclinationJacobian& by_lean,
                               double inclination_sigma_rad, const CameraMount& mount,
                               const InclinationRotation& lean);

}  // namespace vlp
