// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/capability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "station/statistics/control_chart.h"
#include "station/statistics/distributions.h"

namespace vlp {
namespace {

constexpr double kBelow = 0.025, kAbove = 0.975, kNormalQuantile = 1.959963984540054;

}  // namespace

CapabilityIndex compute_cp_index(double tolerance, double sd, double dof) {
  const double cp = tolerance / (6 * sd);
  return {cp, cp * std::sqrt(compute_chi_square_quantile(kBelow, dof) / dof),
          cp * std::sqrt(compute_chi_square_quantile(kAbove, dof) / dof)};
}

CapabilityIndex compute_cpk_index(const ToleranceLimits& limits, double mean, double sd, double dof,
                                  std::size_t count) {
  constexpr double none = std::numeric_limits<double>::infinity();
  const double margin = std::min(limits.upper ? *limits.upper - mean : none,
                                 limits.lower ? mean - *limits.lower : none);
  const double cpk = margin / (3 * sd);
  const double half =
      kNormalQuantile * std::sqrt(1 / (9 * static_cast<double>(count)) + cpk * cpk / (2 * dof));
  return {cpk, cpk - half, cpk + half};
}

std::optional<Capability> compute_capability(std::span<const double> values,
                                             const ToleranceLimits& limits) {
  if (values.size() < 2 || (!limits.lower && !limits.upper)) return std::nullopt;
  const auto count = static_cast<double>(values.size());
  const ControlChart chart = make_control_chart(values);
  double squares = 0;
  for (const double value : values) squares += (value - chart.mean) * (value - chart.mean);
  if (squares == 0) return std::nullopt;
  constexpr double moving_range_factor = 0.826;
  const double dof = count - 1, within_dof = dof / (2 * moving_range_factor);
  Capability result{.count = values.size(),
                    .mean = chart.mean,
                    .within_sd = chart.sigma,
                    .overall_sd = std::sqrt(squares / dof)};
  result.cpk = compute_cpk_index(limits, result.mean, result.within_sd, within_dof, result.count);
  result.ppk = compute_cpk_index(limits, result.mean, result.overall_sd, dof, result.count);
  if (limits.lower && limits.upper) {
    const double tolerance = *limits.upper - *limits.lower;
    result.cp = compute_cp_index(tolerance, result.within_sd, within_dof);
    result.pp = compute_cp_index(tolerance, result.overall_sd, dof);
  }
  return result;
}

}  // namespace vlp
