// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace vlp {

/// Limits of a metric. A gate sets one of them.
struct ToleranceLimits {
  std::optional<double> lower, upper;
};

/// Capability index such as Cpk, dimensionless, with its 95 % confidence interval `low` to `high`.
struct CapabilityIndex {
  double value, low, high;
};

/// Capability and performance of a metric (ISO 22514-2; AIAG SPC). Assumes normally distributed
/// values in chronological order.
///
///   Cp = (U - L) / (6 s),   Cpk = min((U - m) / (3 s), (m - L) / (3 s))
///
/// m is the mean, L and U are the limits. With a single limit Cp is undefined, and Cpk refers to
/// that limit. Capability (Cp, Cpk) uses s = mean moving range / 1.128, the variation between
/// successive units. Performance (Pp, Ppk) uses the standard deviation of all values, including
/// drifts. A Ppk far below Cpk indicates a drift.
///
/// Intervals of Cp and Pp, by chi squared with v degrees of freedom:
///
///   Cp sqrt(chi2(0.025; v) / v)  to  Cp sqrt(chi2(0.975; v) / v)
///
/// Intervals of Cpk and Ppk, by Bissell (1990, Applied Statistics 39, 331-340), which are accurate
/// from n = 30 (Kushler and Hurley 1992, J. Quality Technology 24, 188-195):
///
///   Cpk -+ 1.960 sqrt(1 / (9 n) + Cpk^2 / (2 v))
///
/// v = n - 1 for the standard deviation of all values. For the moving range v = (n - 1) / (2 *
/// 0.826): its variance is 0.826 s^2 / (n - 1) (Cryer and Ryan 1990, J. Quality Technology 22,
/// 187-192).
struct Capability {
  std::size_t count = 0;
  double mean = 0, within_sd = 0, overall_sd = 0;
  /// Indices Cp and Pp; std::nullopt with a single limit.
  std::optional<CapabilityIndex> cp = {}, pp = {};
  CapabilityIndex cpk{}, ppk{};
};

/// Computes capability and performance. Returns std::nullopt for fewer than two values, for equal
/// values, and without a limit.
std::optional<Capability> compute_capability(std::span<const double> values,
                                             const ToleranceLimits& limits);

/// Computes Cp = (U - L) / (6 s) with its interval. `tolerance` is U - L, and `dof` the degrees of
/// freedom of `sd`.
CapabilityIndex compute_cp_index(double tolerance, double sd, double dof);
/// Computes Cpk, the smaller of (U - m) / (3 s) and (m - L) / (3 s), with its interval. `count` is
/// the number of values of the mean. Precondition: at least one limit.
CapabilityIndex compute_cpk_index(const ToleranceLimits& limits, double mean, double sd, double dof,
                                  std::size_t count);

}  // namespace vlp
