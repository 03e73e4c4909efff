// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace vlp {

/// Computes the mean; exactly the common value if all values are equal. Precondition: not empty.
double compute_mean(std::span<const double> values);

/// Returns the quantile of the chi-squared distribution: the x with P(X <= x) = `probability` for
/// `dof` degrees of freedom. Precondition: 0 < probability < 1, dof > 0.
double compute_chi_square_quantile(double probability, double dof);

/// Returns P(X > x) of Fisher's F. Precondition: x >= 0 and finite, both degrees of freedom > 0.
double compute_f_probability(double x, double dof_above, double dof_below);

/// Returns P(|T| > |t|) of Student's t. Precondition: t is finite, dof > 0.
double compute_t_probability(double t, double dof);
/// Returns the quantile t > 0 with compute_t_probability(t, dof) = `both_tails`.
/// Precondition: 0 < both_tails < 1, dof > 0.
double compute_t_quantile(double both_tails, double dof);

}  // namespace vlp
