// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

/// Bounds of chi-squared and Student's t in closed form, for libraries without Boost.
///
/// A bound is given by `sigmas`. Chi-squared exceeds its bound, and t the root of its bound, as
/// rarely as a normal variable of unit variance exceeds `sigmas` on one side. Tested for sigmas of
/// 1.96 (t: 1) to 4.5 and at least two degrees of freedom: the bounds are exceeded as rarely as
/// sigmas - 0.01 to sigmas + 0.3. Few degrees of freedom therefore reduce the power of a test but
/// cause no false alarms.
namespace vlp {

/// Number of standard deviations that a normal variable exceeds with probability 1e-4 on one side:
/// the `sigmas` of tests with a false alarm rate of one in ten thousand.
inline constexpr double kSigmasOfOneInTenThousand = 3.719;

/// Computes the bound of t^2 (Student's t with m degrees of freedom) for `sigmas`, see above.
///
///   m (exp((sigmas (8 m + 3) / (8 m + 1))^2 / m) - 1)
/// Source: Wallace, Bounds on normal approximations to Student's and the chi-square distributions
/// (1959).
inline double compute_squared_t_bound(double sigmas, double m) {
  const double z = sigmas * (8 * m + 3) / (8 * m + 1);
  return m * std::expm1(z * z / m);
}

/// Computes the factor of a variance estimated with m degrees of freedom by which 1.96 standard
/// deviations cover 95 %: the square of the ratio of the quantiles of Student's t and of a normal
/// variable.
inline double compute_student_factor(double m) {
  constexpr double sigmas_of_95_percent = 1.96;
  return compute_squared_t_bound(sigmas_of_95_percent, m) /
         (sigmas_of_95_percent * sigmas_of_95_percent);
}

/// Computes the bound of chi-squared with m degrees of freedom for `sigmas`, see above.
///
///   m (1 - 2 / (9 m) + sigmas sqrt(2 / (9 m)))^3
/// Source: Wilson and Hilferty, The distribution of chi-square (1931).
inline double compute_chi_squared_bound(double sigmas, double m) {
  const double part = 2 / (9 * m);
  const double root = 1 - part + sigmas * std::sqrt(part);
  return m * root * root * root;
}

}  // namespace vlp
