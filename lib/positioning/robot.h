// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "fix.h"

/// Data that a robot has from other sources than images.
namespace vlp {

/// Pose of the camera on the robot: position in the robot's frame, m, and yaw relative to the
/// robot, rad, counter-clockwise seen from above. The robot's frame has its origin at the center
/// and z up.
struct CameraMount {
  Eigen::Vector3d position_in_robot_m;
  double yaw_in_robot_rad;
};

/// Height and yaw of the camera with their standard deviations; 0: exact. Errors of different
/// frames are assumed to be independent.
struct HeightAndYaw {
  double z_m;
  double yaw_rad;
  double z_sd_m = 0;
  double yaw_sd_rad = 0;
};

/// Height in the world with its standard deviation, measured independently of the image.
struct KnownHeight {
  double z_m;
  /// Standard deviation of z_m. Positive.
  double sd_m;
};

/// Gaussian prior of the state of the robot, or, without a mount, of the camera.
struct StatePrior {
  BodyState mean = {};
  /// Covariance (BodyIndex). An infinite variance of X, Y, Z or yaw states nothing. Variance 0 is
  /// exact. Covariances with such states are ignored.
  BodyCovariance covariance = BodyCovariance::Zero();
};

}  // namespace vlp
