// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

namespace vlp {

/// A positive figure of an edge in an image, as a fit of this edge alone has it.
struct EdgeFigure {
  Eigen::Vector2d at_px;
  /// Of the edge.
  Eigen::Vector2d along;
  double value;
  /// Standard deviation of value / the true value.
  double sd;
};

/// How a figure of an image's edges changes over it, slowly:
///   log value = c.(1, x, y, x^2, x y, y^2) + d.(cos 2 t, sin 2 t),
/// with the place (x, y) and the edge's direction t: light falls on paper unevenly, and blur grows
/// to the image's rim and along a motion. Robust, by least squares with weights.
class EdgeField {
 public:
  enum class Terms { place, place_and_direction };

  /// Of few figures only a constant. Precondition: there is one.
  EdgeField(std::span<const EdgeFigure> figures, Terms terms);

  double value(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const;
  /// By how much figures are off it, beyond their own standard deviations, over the value.
  double apart() const { return apart_; }

 private:
  static constexpr Eigen::Index kMostTerms = 8;
  using Row = Eigen::Matrix<double, 1, kMostTerms>;
  Row row(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const;

  Eigen::Vector2d middle_px_{0, 0};
  double reach_px_ = 1;
  Eigen::Index terms_;
  Eigen::Matrix<double, kMostTerms, 1> coefficients_ = Eigen::Matrix<double, kMostTerms, 1>::Zero();
  double apart_ = 0;
};

}  // namespace vlp
