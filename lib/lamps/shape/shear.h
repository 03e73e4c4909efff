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
};

/// Normal equations of the residuals of an outline with respect to its fitted circle, in the level
/// plane and in units of the radius. The unknowns p_0 to p_4 are center x, center y, radius, and
/// both components of the ovality. They move the point in direction a outwards by
///   p_0 cos a + p_1 sin a + p_2 + p_3 cos 2a + p_4 sin 2a.
class OutlineSums {
 public:
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  struct Estimate {
    Vector5 p;
    Matrix5 covariance;
  };

  /// Creates empty normal equations.
  OutlineSums() = default;
  /// Accumulates the normal equations of the counted points.
  /// @param points      points of the complete outline, in the level plane
  /// @param weights     weights of the points
  /// @param counted     true for the points to add
  /// @param line_slope  derivative of the scanline at which a point near the circle is read with
  ///        respect to its x, y
  /// @param num_correlated  number of neighboring points with a common error
  OutlineSums(std::span<const Eigen::Vector2d> points, std::span<const double> weights,
              const std::vector<bool>& counted, const Circle& circle,
              const Eigen::Vector2d& line_slope, double num_correlated = 1);

  /// Solves for p, with the oval as a prior if it is known. The variance is that of the residuals
  /// times the number of points with a common error. Returns std::nullopt if the points do not
  /// determine p.
  std::optional<Estimate> solve_outline_with_oval_prior(const std::optional<Oval>& known) const;

  bool empty() const { return count_ == 0; }
  const Circle& fitted_circle() const { return circle_; }
  const Eigen::Vector2d& scanline_gradient_wrt_position() const { return line_slope_; }

 private:
  Circle circle_{Eigen::Vector2d::Zero(), 1};
  Eigen::Vector2d line_slope_ = Eigen::Vector2d::Zero();
  Matrix5 normal_ = Matrix5::Zero();
  Vector5 gradient_ = Vector5::Zero();
  double squares_ = 0, weight_ = 0, num_correlated_ = 1;
  int count_ = 0;
};

/// Shear of circles by a rolling shutter in a moving camera.
///
/// In the level plane lights move by v + w (-y, x) per scanline. A point at d from the center is
/// read s . d scanlines later (s: line_slope) and displaced by s . d times this motion. In complex
/// numbers the oval is s (v + i w (x + i y)) / 2. The center of a complete outline is not
/// displaced; the center of a partial outline is. Lamps at other heights have another v, which is
/// modeled as an error of 15 %.
class Shear {
 public:
  /// Estimates the motion from lights with a sufficiently visible outline. Rejects lights that
  /// contradict the majority. Returns std::nullopt if less than half of the lights agree, or if the
  /// motion is not significant.
  static std::optional<Shear> estimate_shear_from_outlines(std::span<const OutlineSums> lights);

  /// Returns the oval of a light's outline that the motion causes, with its covariance.
  Oval predict_oval_from_motion(const OutlineSums& light) const;
  /// Returns the motion of a light in the level plane per scanline.
  Eigen::Vector2d motion_per_scanline(const OutlineSums& light) const;

 private:
  Shear(const Eigen::Vector3d& motion, const Eigen::Matrix3d& covariance)
      : motion_(motion), covariance_(covariance) {}

  /// Half of the motion per scanline (v_x, v_y, w) in the level plane.
  Eigen::Vector3d motion_;
  Eigen::Matrix3d covariance_;
};

}  // namespace vlp
