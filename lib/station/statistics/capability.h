// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace vlp {

/// Between which values a figure has to be; a gate has one of the two.
struct ToleranceLimits {
  std::optional<double> lower, upper;
};

/// An index with its 95 % interval.
struct CapabilityIndex {
  double value, low, high;
};

/// How a figure's scatter compares with its limits (ISO 22514-2; AIAG SPC), of values in the order
/// of time, normally distributed:
///
///   Cp = (U - L) / (6 s),   Cpk = min((U - m) / (3 s), (m - L) / (3 s)),
///
/// m the mean; with one limit there is no Cp, and Cpk is of that limit. Capability (Cp, Cpk) takes
/// for s the mean moving range / 1.128, what differs from one unit to the next; performance (Pp,
/// Ppk) the standard deviation of all values, drifts included. That Ppk is much below Cpk tells of
/// a drift.
///
/// Intervals: of Cp, Pp by chi squared, Cp sqrt(chi2(0.025; v) / v) to Cp sqrt(chi2(0.975; v) / v);
/// of Cpk, Ppk those of Bissell (1990, Applied Statistics 39, 331-340), which Kushler and Hurley
/// (1992, J. Quality Technology 24, 188-195) found good from n = 30 on:
///
///   Cpk -+ 1.960 sqrt(1 / (9 n) + Cpk^2 / (2 v)).
///
/// v = n - 1 for all values; of the moving range, whose variance is 0.826 s^2 / (n - 1) (Cryer and
/// Ryan 1990, J. Quality Technology 22, 187-192), v = (n - 1) / (2 * 0.826).
struct Capability {
  std::size_t count = 0;
  double mean = 0, within_sd = 0, overall_sd = 0;
  /// Only with two limits.
  std::optional<CapabilityIndex> cp = {}, pp = {};
  CapabilityIndex cpk{}, ppk{};
};

/// Nothing for fewer than two values, for values that do not differ, and without a limit.
std::optional<Capability> capability(std::span<const double> values, const ToleranceLimits& limits);

/// (U - L) / (6 s) with its interval, of a standard deviation with these degrees of freedom.
CapabilityIndex cp_of(double tolerance, double sd, double dof);
/// The smaller of (U - m) / (3 s) and (m - L) / (3 s), of a mean of so many values. Precondition:
/// there is a limit.
CapabilityIndex cpk_of(const ToleranceLimits& limits, double mean, double sd, double dof,
                       std::size_t count);

}  // namespace vlp
