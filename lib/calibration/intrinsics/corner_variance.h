// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace vlp {

/// A corner's error: the mean of the squares of its residual's axes, and its standard deviation by
/// the noise of its pixels.
struct CornerError {
  double square_px2, sd_px;
};

/// What corners are good for, since by that a solve has to weigh them (least squares, Gauss and
/// Markov): behind JPEG those in the dark corners of an image are five times as uncertain as those
/// in its middle. Of the noise of their pixels, which need not be independent, and of all else that
/// no pixel tells, such as how the board is printed:
///   variance = rest^2 + scale^2 sd^2.
struct CornerVariance {
  double rest_px2 = 0, scale2 = 0;

  double of(double sd_px) const { return rest_px2 + scale2 * sd_px * sd_px; }
};

/// The variance components by least squares of the squares that are left, each over its variance,
/// neither below 0; beyond three standard deviations a residual counts as that. No corner is taken
/// for better than 4 % of what all are off in the mean, lest it weighs all. Precondition: there are
/// errors, not all of them 0; deviations are finite.
CornerVariance corner_variance(std::span<const CornerError> errors);

/// What a solve multiplies residuals by:
///   weight^2 = mean of the squares of the residuals / variance,
/// the mean of corners of which a deviation is known, so that the rms of weighted residuals is what
/// those are off. Corners of which nobody knows a deviation, whose edges were not found, have a
/// variance of their own, by what is left of them, no less than that mean. Beyond three standard
/// deviations a residual counts as that.
class CornerWeights {
 public:
  /// Of corners of which the deviation is known, and of those of which it is not. Precondition:
  /// there are some of the first, not all of them 0.
  CornerWeights(std::span<const CornerError> told, std::span<const CornerError> untold);

  /// By a corner's deviation, 0 where nobody knows it.
  double of(double sd_px) const;

 private:
  CornerVariance variance_;
  double untold_px2_, mean_px2_;
};

}  // namespace vlp
