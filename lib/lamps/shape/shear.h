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

/// How oval an outline is: a point in direction a of the centre lies
/// 1 + oval_0 cos 2a + oval_1 sin 2a radii away.
struct Oval {
  Eigen::Vector2d oval;
  Matrix2 covariance;
};

/// What the circle that is fitted to an outline leaves of it, in the level plane and in units of
/// its radius: sums for the least squares of p = (centre x, y, radius, oval), where a point in
/// direction a lies p_0 cos a + p_1 sin a + p_2 + p_3 cos 2a + p_4 sin 2a further out.
class OutlineSums {
 public:
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  struct Estimate {
    Vector5 p;
    Matrix5 covariance;
  };

  /// Of no points.
  OutlineSums() = default;
  /// points, weights: of the whole outline; counted: those that the sums are of. line_slope: of the
  /// number of the line in which the shutter reads a point near the circle, over the point's x, y.
  /// together: how many points err together.
  OutlineSums(std::span<const Eigen::Vector2d> points, std::span<const double> weights,
              const std::vector<bool>& counted, const Circle& circle,
              const Eigen::Vector2d& line_slope, double together = 1);

  /// With the oval known beforehand, or not at all. The variance is that of what is left,
  /// times the points that err together. Nothing
  /// when the points do not tell.
  std::optional<Estimate> solved(const std::optional<Oval>& known) const;

  bool empty() const { return count_ == 0; }
  const Circle& circle() const { return circle_; }
  const Eigen::Vector2d& line_slope() const { return line_slope_; }

 private:
  Circle circle_{Eigen::Vector2d::Zero(), 1};
  Eigen::Vector2d line_slope_ = Eigen::Vector2d::Zero();
  Matrix5 normal_ = Matrix5::Zero();
  Vector5 gradient_ = Vector5::Zero();
  double squares_ = 0, weight_ = 0, together_ = 1;
  int count_ = 0;
};

/// What a shutter that reads line by line makes of circles while the camera moves. In the level
/// plane lights move by v + w (-y, x) per line, so that a point d off the centre, read s . d lines
/// later (line_slope), is displaced by that times s . d: in complex numbers the oval is
/// s (v + i w (x + i y)) / 2. The centre of a whole outline stays, that of a part does not. Lamps
/// at other heights have another v, which counts as an error of 15 %.
class Shear {
 public:
  /// From lights of which enough is seen, as far as they agree. Nothing when they are too few, or
  /// show none beyond doubt.
  static std::optional<Shear> common(std::span<const OutlineSums> lights);

  /// Of a light there.
  Oval oval_of(const OutlineSums& light) const;
  /// By how much of the level plane a light there moves per line.
  Eigen::Vector2d motion_at(const OutlineSums& light) const;

 private:
  Shear(const Eigen::Vector3d& motion, const Eigen::Matrix3d& covariance)
      : motion_(motion), covariance_(covariance) {}

  /// (v, w) / 2
  Eigen::Vector3d motion_;
  Eigen::Matrix3d covariance_;
};

}  // namespace vlp
