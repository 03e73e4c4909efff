// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/distributions.h"

#include <cmath>
#include <limits>

namespace vlp {
namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();
constexpr int kMostTerms = 100'000;
constexpr double kTiny = 1e-300;

/// A denominator of Lentz's method, which must not be 0.
double away_from_0(double value) { return std::abs(value) < kTiny ? kTiny : value; }

/// P(a, x) by its series.
double lower_gamma(double a, double x) {
  double term = 1 / a, sum = term;
  for (int n = 1; n < kMostTerms && term > kRounding * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// 1 - P(a, x) by its continued fraction, with Lentz's method.
double upper_gamma(double a, double x) {
  double b = x + 1 - a, c = 1 / kTiny, d = 1 / b, fraction = d;
  for (int n = 1; n < kMostTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2;
    d = 1 / away_from_0(numerator * d + b);
    c = away_from_0(b + numerator / c);
    fraction *= c * d;
    if (std::abs(c * d - 1) < 4 * kRounding) break;
  }
  return fraction * std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// The continued fraction of the incomplete beta function, with Lentz's method.
double beta_fraction(double a, double b, double x) {
  double c = 1, d = 1 / away_from_0(1 - (a + b) * x / (a + 1)), fraction = d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / away_from_0(1 + even * d);
    c = away_from_0(1 + even / c);
    fraction *= c * d;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / away_from_0(1 + odd * d);
    c = away_from_0(1 + odd / c);
    fraction *= c * d;
    if (std::abs(c * d - 1) < 4 * kRounding) break;
  }
  return fraction;
}

/// I_x(a, b).
double regularized_beta(double a, double b, double x) {
  if (x <= 0 || x >= 1) return x <= 0 ? 0 : 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  // Either converges fast on its side.
  if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(a, b, x) / a;
  return 1 - front * beta_fraction(b, a, 1 - x) / b;
}

}  // namespace

double chi_square_cdf(double x, double dof) {
  if (x <= 0) return 0;
  const double a = dof / 2, half = x / 2;
  return half < a + 1 ? lower_gamma(a, half) : 1 - upper_gamma(a, half);
}

double chi_square_quantile(double probability, double dof) {
  double low = 0, high = dof + 1;
  while (chi_square_cdf(high, dof) < probability) high *= 2;
  for (double middle = high / 2; middle > low && middle < high; middle = (low + high) / 2) {
    (chi_square_cdf(middle, dof) < probability ? low : high) = middle;
  }
  return high;
}

double f_upper_tail(double x, double dof_above, double dof_below) {
  if (x <= 0) return 1;
  return regularized_beta(dof_below / 2, dof_above / 2, dof_below / (dof_below + dof_above * x));
}

double t_two_tails(double t, double dof) { return f_upper_tail(t * t, 1, dof); }

double t_quantile(double both_tails, double dof) {
  double low = 0, high = 1;
  while (t_two_tails(high, dof) > both_tails) high *= 2;
  for (double middle = high / 2; middle > low && middle < high; middle = (low + high) / 2) {
    (t_two_tails(middle, dof) > both_tails ? low : high) = middle;
  }
  return high;
}

double mean_of(std::span<const double> values) {
  double above_first = 0;
  for (const double value : values) above_first += value - values.front();
  return values.front() + above_first / static_cast<double>(values.size());
}

}  // namespace vlp
