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
/// neither below 0; beyond three standard deviations a residual counts as that. Precondition: there
/// are errors, not all of them 0.
CornerVariance corner_variance(std::span<const CornerError> errors);

}  // namespace vlp
