// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace vlp {

/// Mapping between rays and the image plane of focal length 1 with the principal point (0, 0):
///   pixel = f * plane + c
/// The distortions are the parameters after fx fy cx cy. Const and safe to share between threads.
class LensFamily {
 public:
  virtual ~LensFamily() = default;

  /// Projects a point of the camera frame, in any unit, to the image plane of focal length 1.
  /// @return position in focal lengths from the principal point; std::nullopt or not finite for a
  ///     point that the model does not describe
  virtual std::optional<Eigen::Vector2d> project_to_plane(
      const Eigen::Vector3d& x_in_camera) const = 0;

  struct Jacobians {
    Eigen::Matrix<double, 2, 3> d_plane_d_point;
    /// Derivative of the position in the plane with one column per distortion. Empty for models
    /// with more than twelve, see differentiate_distortions().
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::DontAlign, 2, 12> d_plane_d_distortions;
  };
  /// Computes the Jacobians of project_to_plane(). Does not allocate.
  /// @pre project_to_plane() returns a finite position.
  virtual Jacobians compute_jacobians(const Eigen::Vector3d& x_in_camera) const = 0;

  /// Derivative of one coordinate of the plane, x (axis 0) or y (axis 1), with respect to one
  /// distortion.
  struct DistortionDerivative {
    Eigen::Index distortion;
    int axis;
    double d_plane;
  };
  /// Computes the derivatives for models with more than twelve distortions: only those of
  /// distortions that the position depends on, in ascending order. Empty for other models.
  /// @pre project_to_plane() returns a finite position.
  virtual std::vector<DistortionDerivative> differentiate_distortions(
      const Eigen::Vector3d&) const {
    return {};
  }

  struct Ray {
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 3, 2> d_direction_d_plane;
  };
  /// Computes the ray in the camera frame, not of unit length, of a finite position in the image
  /// plane. Returns std::nullopt if project_to_plane() maps no point to it.
  virtual std::optional<Ray> unproject_from_plane(const Eigen::Vector2d& plane) const = 0;
};

}  // namespace vlp
