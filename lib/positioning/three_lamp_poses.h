// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

namespace vlp {

/// A camera that leans by any angle: x_in_camera = camera_from_world (x_in_world - position_m).
struct FreePose {
  Eigen::Matrix3d camera_from_world;
  Eigen::Vector3d position_m;
};

struct ThreeLampPoses {
  int count = 0;
  std::array<FreePose, 4> poses;
};

/// The poses that see three points along three rays (unit length): up to four. With the distances
/// d_i and the cosines c_ik between the rays,
///   d_i^2 + d_k^2 - 2 c_ik d_i d_k = |P_i - P_k|^2
/// is three cones in d. Two of their combinations are conics through the same four points of the
/// plane of ratios d_1 : d_2 : d_3; one root of a cubic makes a pair of lines of them, on which the
/// points are the roots of quadratics (Haralick et al., "Review and Analysis of Solutions of the
/// Three Point Perspective Pose Estimation Problem", 1994, tells of this way and others).
/// Exact to rounding where the solutions are apart. Where two have just vanished, the one between
/// them is given, which sees the points only nearly along the rays. None for points on one line.
ThreeLampPoses three_lamp_poses(const std::array<Eigen::Vector3d, 3>& points_m,
                                const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace vlp
