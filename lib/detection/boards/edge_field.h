// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

namespace vlp {

/// Positive property of an edge in an image (blur or light), from a fit of this edge alone.
struct EdgeSample {
  Eigen::Vector2d at_px;
  /// Direction of the edge in the image (u, v), of unit length. The sign has no effect.
  Eigen::Vector2d along;
  double value;
  /// Standard deviation of `value` divided by `value`.
  double sd;
};

/// Smooth model of a property of the edges over an image:
///   log value = c.(1, x, y, x^2, x y, y^2) + d.(cos 2 t, sin 2 t),
/// with the position (x, y) and the direction t of the edge. Illumination of the board is uneven;
/// blur increases towards the image border and along a motion. Fitted by iteratively reweighted
/// least squares, which is robust to outliers.
class EdgeField {
 public:
  enum class Terms { position, position_and_direction };

  /// Fits the model; only a constant for fewer than 32 samples.
  /// @pre There is at least one sample.
  EdgeField(std::span<const EdgeSample> samples, Terms terms);

  double evaluate_at_edge(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const;
  /// Relative standard deviation of the edges from the model that exceeds their own standard
  /// deviations.
  double edge_scatter_beyond_fit_sd() const { return excess_sd_; }

 private:
  static constexpr Eigen::Index kMaxTerms = 8;
  using Row = Eigen::Matrix<double, 1, kMaxTerms>;
  Row make_design_row(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const;

  Eigen::Vector2d middle_px_{0, 0};
  double reach_px_ = 1;
  Eigen::Index terms_;
  Eigen::Matrix<double, kMaxTerms, 1> coefficients_ = Eigen::Matrix<double, kMaxTerms, 1>::Zero();
  double excess_sd_ = 0;
};

}  // namespace vlp
