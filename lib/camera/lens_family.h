// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace vlp {

/// What a lens does between a ray and the plane of focal length 1, whose centre is (0, 0):
///   pixel = f * plane + c
/// with the distortions, the parameters after fx fy cx cy. Const and safe to share between threads.
class LensFamily {
 public:
  virtual ~LensFamily() = default;

  /// Where a point (any length unit) lies in the plane; nothing, or what is not finite, for a point
  /// that the model does not describe.
  virtual std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& x_in_camera) const = 0;

  struct Jacobians {
    Eigen::Matrix<double, 2, 3> d_plane_d_point;
    /// A column per distortion; none where there are more than twelve, which by_distortions() has.
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::DontAlign, 2, 12> d_plane_d_distortions;
  };
  /// Precondition, here and below: project() gives a finite place. Does not allocate.
  virtual Jacobians jacobians(const Eigen::Vector3d& x_in_camera) const = 0;

  /// The share of a distortion of more than twelve in the plane's x (axis 0) or y (1).
  struct ByDistortion {
    Eigen::Index distortion;
    int axis;
    double d_plane;
  };
  /// By distortion, ascending; only those that the place depends on.
  virtual std::vector<ByDistortion> by_distortions(const Eigen::Vector3d&) const { return {}; }

  struct Ray {
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 3, 2> d_direction_d_plane;
  };
  /// Of a finite place; nothing for one that project() gives of no point.
  virtual std::optional<Ray> unproject(const Eigen::Vector2d& plane) const = 0;
};

}  // namespace vlp
