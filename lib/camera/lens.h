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

/// A lens: camera rays to pixels and back, by the equations of lens_model.h. Built once; const and
/// safe to share between threads.
class Lens {
 public:
  /// `parameters` in mrcal's order. Throws std::invalid_argument when their number is not
  /// parameter_count(model), one is not finite or a focal length is not positive.
  Lens(LensModel model, std::span<const double> parameters);

  LensModel model() const { return model_; }
  /// fx, fy in pixels.
  const Eigen::Vector2d& focal_px() const { return focal_px_; }
  /// cx, cy in pixels.
  const Eigen::Vector2d& center_px() const { return center_px_; }

  /// The pixel of a point (any length unit but zero). Nothing for a point that the lens model
  /// does not describe: at or behind the camera's plane z = 0 (of models that see behind it:
  /// straight behind), beyond Distortion::valid_radius, Fisheye::valid_angle_rad or
  /// SplineSurface::reach and their like, or not finite.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& x_in_camera) const;

  struct Projection {
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> d_pixel_d_point;
    /// A column per parameter, in mrcal's order; of a splined lens, which has hundreds, those of
    /// fx, fy, cx, cy alone.
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::DontAlign, 2, 16> d_pixel_d_parameters;
  };
  /// As project(), with both Jacobians. Does not allocate.
  std::optional<Projection> project_with_jacobians(const Eigen::Vector3d& x_in_camera) const;

  /// The parameters that a pixel depends on, and how.
  struct ByParameters {
    /// In mrcal's order, ascending.
    std::vector<Eigen::Index> parameters;
    Eigen::Matrix2Xd d_pixel;
  };
  /// Of the pixel of a point that project() accepts: all of them, control points, too.
  std::optional<ByParameters> by_parameters(const Eigen::Vector3d& x_in_camera) const;

  struct Ray {
    /// Not of unit length: z = 1 for PINHOLE and OPENCVn, z <= 1, and may be negative, for others.
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 3, 2> d_direction_d_pixel;
  };
  /// The ray of a pixel. OPENCVn and splines by Newton's method with step halving, until the last
  /// step leaves an error below 1e-12 (the Jacobian, taken before it, is good to 1e-6 of itself).
  /// Nothing where it does not converge to a ray that project() accepts: pixels that no ray
  /// reaches, or that are not finite.
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;

 private:
  LensModel model_;
  Eigen::Vector2d focal_px_;
  Eigen::Vector2d center_px_;
  /// What tells its model from others, shared between copies.
  std::shared_ptr<const LensFamily> family_;
};

}  // namespace vlp
