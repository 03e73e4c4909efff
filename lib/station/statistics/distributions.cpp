// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace vlp {

using boost::math::complement;

double compute_mean(std::span<const double> values) {
  double above_first = 0;
  for (const double value : values) above_first += value - values.front();
  return values.front() + above_first / static_cast<double>(values.size());
}

double compute_chi_square_quantile(double probability, double dof) {
  return quantile(boost::math::chi_squared(dof), probability);
}

double compute_f_probability(double x, double dof_above, double dof_below) {
  return cdf(complement(boost::math::fisher_f(dof_above, dof_below), x));
}

double compute_t_probability(double t, double dof) {
  return 2 * cdf(complement(boost::math::students_t(dof), std::abs(t)));
}

double compute_t_quantile(double both_tails, double dof) {
  return quantile(complement(boost::math::students_t(dof), both_tails / 2));
}

}  // namespace vlp
