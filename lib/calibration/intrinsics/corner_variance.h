// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace vlp {

/// Error of a corner: mean of the squared residuals of both axes, px^2, and standard deviation from
/// pixel noise, px.
struct CornerError {
  double square_px2, sd_px;
};

/// Variance model of a corner position, per axis, px^2:
///   variance = floor_px2 + scale2 sd_px^2
///   sd_px      standard deviation of the corner predicted from pixel noise, px
///   scale2     factor that allows for correlated noise
///   floor_px2  variance of errors that pixels do not show, such as printing errors of the board
///
/// A least-squares solve has to weight residuals by their variances (Gauss and Markov). Behind
/// JPEG, corners in the dark corners of an image are five times as uncertain as those in the
/// middle.
struct CornerVariance {
  double floor_px2 = 0, scale2 = 0;

  /// Returns the variance of a corner per axis, px^2. `sd_px` is its standard deviation from pixel
  /// noise.
  double variance_px2(double sd_px) const { return floor_px2 + scale2 * sd_px * sd_px; }
};

/// Estimates the variance components by least squares of the squared residuals, each divided by its
/// variance. Neither component is negative.
///
/// A residual beyond three standard deviations counts as three. The standard deviation of a corner
/// is at least 4 % of the RMS residual of all, so that no corner dominates.
/// @pre at least one error, not all of them 0; standard deviations are finite
CornerVariance fit_corner_variance(std::span<const CornerError> errors);

/// Factors by which a solve multiplies residuals:
///   weight^2 = mean of the squared residuals / variance.
/// The mean is over corners with a predicted standard deviation, so that the RMS of weighted
/// residuals equals the RMS residual of those corners.
///
/// Corners without a predicted standard deviation, whose edges were not found, have a common
/// variance. It is estimated from their residuals and at least that mean. A residual beyond three
/// standard deviations counts as three.
class CornerWeights {
 public:
  /// Estimates the weights from the residuals of all corners.
  /// @param known    corners with a predicted standard deviation; at least one, not all residuals 0
  /// @param unknown  corners without one
  CornerWeights(std::span<const CornerError> known, std::span<const CornerError> unknown);

  /// Returns the weight of a corner. `sd_px`: its predicted standard deviation, px; 0 if unknown.
  double corner_weight(double sd_px) const;

 private:
  CornerVariance variance_;
  double unknown_px2_, mean_px2_;
};

}  // namespace vlp
