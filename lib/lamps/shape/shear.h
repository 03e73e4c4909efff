// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/circle_fit.h"
#include "geometry/types.h"

namespace vlp {

/// Ovality of an outline: a point in direction a is at the distance 1 + oval_0 cos 2a + oval_1 sin
/// 2a from the center, in radii.
struct Oval {
  Eigen::Vector2d oval;
  Matrix2 covariance;

  /// Returns the matrix that maps the outline, relative to its center and in radii, to the unit
  /// circle, to first order in the ovality.
  Matrix2 unit_from_oval() const {
    return Matrix2{{1 - oval[0], -oval[1]}, {-oval[1], 1 + oval[0]}};
  }
};

/// Normal equations of an outline with respect to its fitted circle, in the level plane and in
/// units of the radius. The unknowns p_0 to p_4 are center x, center y, radius, and both components
/// of the ovality. They move the point in direction a outwards by
///   p_0 cos a + p_1 sin a + p_2 + p_3 cos 2a + p_4 sin 2a.
/// `matrix` is the inverse of their covariance, `gradient` the matrix times their estimate.
struct OutlineEquations {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  struct Estimate {
    Vector5 p;
    Matrix5 covariance;
  };

  Circle circle;
  Matrix5 matrix;
  Vector5 gradient;
  /// Derivative of the scanline at which a point near the circle is read with respect to its x, y.
  Eigen::Vector2d scanline_gradient;

  /// Solves for p, with the oval as a prior if it is known. Returns std::nullopt if the outline
  /// does not determine p.
  std::optional<Estimate> solve_with_oval_prior(const std::optional<Oval>& known) const;
};

/// Shear of circles by a rolling shutter in a moving camera.
///
/// In the level plane lights move by v + w (-y, x) per scanline. A point at d from the center is
/// read s . d scanlines later (s: OutlineEquations::scanline_gradient) and displaced by s . d times
/// this motion. In complex numbers the oval is s (v + i w (x + i y)) / 2. The center of a complete
/// outline is not displaced; the center of a partial outline is. Lamps at other heights have
/// another v, which is modeled as an error of 15 %.
class Shear {
 public:
  /// Estimates the motion from lights with a sufficiently visible outline. Rejects lights that
  /// contradict the majority. Returns std::nullopt if less than half of the lights agree, or if the
  /// motion is not significant. Ovals that agree better than their variances state are up to twice
  /// as significant.
  static std::optional<Shear> estimate_shear(std::span<const OutlineEquations> lights);

  /// Returns the oval of a light's outline that the motion causes, with its covariance.
  Oval predict_oval(const OutlineEquations& light) const;
  /// Returns the motion of a light in the level plane per scanline.
  Eigen::Vector2d motion_per_line(const OutlineEquations& light) const;

 private:
  Shear(const Eigen::Vector3d& motion, const Eigen::Matrix3d& covariance)
      : motion_(motion), covariance_(covariance) {}

  /// Half of the motion per scanline (v_x, v_y, w) in the level plane.
  Eigen::Vector3d motion_;
  Eigen::Matrix3d covariance_;
};

}  // namespace vlp
