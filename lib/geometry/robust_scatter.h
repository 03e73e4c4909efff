// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "geometry/median.h"

/// Robust variance of residuals in the plane with outliers, from the median, and the bound above
/// which a residual is an outlier. Valid for samples of any size.
///
/// Let residuals be normal with variance sigma^2 per coordinate. The median of the squared lengths
/// is then 2 ln 2 sigma^2. Least squares with nu degrees of freedom reduce the variance of the
/// residuals by the factor nu / (number of coordinates). The variance estimated from the median is
/// as uncertain as a variance of m = nu ln^2 2 degrees of freedom.
namespace vlp {

/// Estimates the variance of the errors per axis from the median of the squared lengths of
/// residuals in the plane. Outliers barely affect it.
///
/// @param squares             squared lengths of the residuals, not empty, in any unit squared
/// @param degrees_of_freedom  number of coordinates minus number of unknowns; at least 1 is assumed
/// @return                    variance per axis, in the unit of `squares`
inline double estimate_variance_2d(std::vector<double> squares, double degrees_of_freedom) {
  assert(!squares.empty());
  constexpr double median_of_unit_variance = 2 * std::numbers::ln2;
  const double rows = 2 * static_cast<double>(squares.size());
  return upper_median(std::move(squares)) / median_of_unit_variance * rows /
         std::max(degrees_of_freedom, 1.0);
}

/// Computes the outlier bound of squared lengths, in units of estimate_variance_2d(). Normal
/// residuals exceed it as rarely as they exceed sigmas^2 if the variance is known.
///
/// Half the quotient is F(2, m), and the quotient exceeds x with the probability
/// (1 + x / m)^(-m / 2): x = m (exp(sigmas^2 / m) - 1).
inline double compute_outlier_bound_2d(double sigmas, double degrees_of_freedom) {
  constexpr double m_per_row = std::numbers::ln2 * std::numbers::ln2;
  const double m = m_per_row * std::max(degrees_of_freedom, 1.0);
  return m * std::expm1(sigmas * sigmas / m);
}

}  // namespace vlp
