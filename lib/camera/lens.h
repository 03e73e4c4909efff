// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "lens_model.h"

namespace vlp {

class LensFamily;  // camera/lens_family.h

/// Lens with fixed parameters, which maps camera rays to pixels and back by the equations of
/// lens_model.h. Const and safe to share between threads.
class Lens {
 public:
  /// Creates a lens from its parameters in the order of mrcal: fx fy cx cy, px, followed by the
  /// distortions of the model (lens_model.h).
  /// @throws std::invalid_argument if their number is not num_lens_parameters(model), a parameter
  /// is
  ///     not finite or a focal length is not positive
  Lens(LensModel model, std::span<const double> parameters);

  LensModel lens_model() const { return model_; }
  /// Focal lengths fx, fy in pixels.
  const Eigen::Vector2d& focal_px() const { return focal_px_; }
  /// Principal point cx, cy in pixels.
  const Eigen::Vector2d& principal_point_px() const { return center_px_; }

  /// Projects a point of the camera frame to a pixel (u, v), px.
  ///
  /// @param x_in_camera  point in the camera frame, in any unit, not the origin
  /// @return             std::nullopt if the lens model does not describe the point
  ///
  /// Not described are points that are not finite, and:
  ///   PINHOLE, OPENCVn  at or behind the plane z = 0
  ///   other models      straight behind the camera
  ///   OPENCVn, OPENCV_FISHEYE, splined
  ///                     beyond Distortion::compute_max_radius(),
  ///                     Fisheye::max_angle_rad() or
  ///                     SplineSurface::spline_half_extent()
  std::optional<Eigen::Vector2d> project_point(const Eigen::Vector3d& x_in_camera) const;

  struct Projection {
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> d_pixel_d_point;
    /// Derivative of the pixel with one column per parameter, in mrcal's order. Splined lenses have
    /// hundreds of parameters; their columns are those of fx, fy, cx, cy only.
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::DontAlign, 2, 16> d_pixel_d_parameters;
  };
  /// Projects a point as project_point() does and computes both Jacobians. Does not allocate.
  std::optional<Projection> project_with_jacobians(const Eigen::Vector3d& x_in_camera) const;

  /// Sparse Jacobian of a pixel with respect to the parameters of the lens.
  struct SparseJacobian {
    /// Indices of the parameters that the pixel depends on, in mrcal's order, ascending.
    std::vector<Eigen::Index> parameters;
    /// Derivative of the pixel, px, with one column per entry of `parameters`.
    Eigen::Matrix2Xd d_pixel;
  };
  /// Computes the Jacobian of a point's pixel with respect to all parameters, including the control
  /// points of splined lenses. Returns std::nullopt for points that project_point() rejects.
  std::optional<SparseJacobian> differentiate_intrinsics(const Eigen::Vector3d& x_in_camera) const;

  struct Ray {
    /// Direction, not of unit length: z = 1 for PINHOLE and OPENCVn; z <= 1 for other models, where
    /// it may be negative.
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 3, 2> d_direction_d_pixel;
  };
  /// Computes the ray of a pixel (u, v) in the camera frame. Returns std::nullopt if the pixel is
  /// not finite or no ray that project_point() accepts is found for it.
  ///
  /// OPENCVn and splined lenses use Newton's method with step halving, until the last step reduces
  /// the error below 1e-12. The Jacobian is evaluated before that step and is accurate to 1e-6
  /// (relative).
  std::optional<Ray> unproject_pixel(const Eigen::Vector2d& pixel) const;

 private:
  LensModel model_;
  Eigen::Vector2d focal_px_;
  Eigen::Vector2d center_px_;
  /// Equations of the model with its distortion parameters, shared between copies.
  std::shared_ptr<const LensFamily> family_;
};

}  // namespace vlp
