// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

namespace vlp {

/// Pose of a camera with any rotation: x_in_camera = camera_from_world (x_in_world - position_m).
struct FreePose {
  Eigen::Matrix3d camera_from_world;
  Eigen::Vector3d position_m;
};

/// Poses of a camera with any rotation that explain three lamps: `count` of them, 0 to 4, at the
/// beginning of `poses`.
struct ThreeLampPoses {
  int count = 0;
  std::array<FreePose, 4> poses;
};

/// Computes the poses, up to four, that project three points along three rays of unit length (P3P).
/// With the distances d_i and the cosines c_ik between the rays, three cones in d are intersected:
///   d_i^2 + d_k^2 - 2 c_ik d_i d_k = |P_i - P_k|^2
/// Two linear combinations of them are conics through the same four points of the plane of ratios
/// d_1 : d_2 : d_3. One root of a cubic gives a degenerate conic, a pair of lines. On these lines
/// the points are the roots of quadratics.
///
/// Exact to rounding if the solutions are separate. If two solutions have just vanished, as by
/// noise, returns the point between them, which fits the rays only approximately. Returns none for
/// collinear points. Source: Haralick et al., "Review and Analysis of Solutions of the Three Point
/// Perspective Pose Estimation Problem", 1994, compares this and other methods.
ThreeLampPoses solve_three_lamp_poses(const std::array<Eigen::Vector3d, 3>& points_m,
                                      const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace vlp
