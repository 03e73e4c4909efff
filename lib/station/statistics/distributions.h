// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace vlp {

/// Of equal values their value to the last bit. Precondition: not empty.
double mean_of(std::span<const double> values);

/// P(X <= x) of chi squared, of any positive degrees of freedom: the regularized incomplete gamma
/// function P(dof / 2, x / 2) (NIST DLMF 8.7.1 below the mean, 8.9.2 above).
double chi_square_cdf(double x, double dof);
/// Its inverse, to rounding. Precondition: 0 < probability < 1.
double chi_square_quantile(double probability, double dof);

/// P(X > x) of Fisher's F: the regularized incomplete beta function (NIST DLMF 8.17.22).
double f_upper_tail(double x, double dof_above, double dof_below);

/// P(|T| > |t|) of Student's t, whose square is F(1, dof).
double t_two_tails(double t, double dof);
/// Its inverse, to rounding: the t > 0 beyond which, on both sides, lies so much. Precondition: 0 <
/// both_tails < 1.
double t_quantile(double both_tails, double dof);

}  // namespace vlp
