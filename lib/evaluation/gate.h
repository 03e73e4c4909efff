// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/metric.h"

namespace vlp {

class [[gnu::visibility("hidden")]] YamlValue;

/// Guard band that allows for measurement uncertainty in an acceptance decision (guarded
/// acceptance, JCGM 106:2012, section 8.3.2). A metric is accepted up to limit - k u, or from limit
/// + k u on.
///
/// Metrics whose true value is at the limit are accepted with the probability 1 - Phi(k): 0.05 for
/// k = 1.645 (ISO 14253-1), 0.023 for k = 2.
struct GuardBand {
  /// Standard uncertainty u of the measured metric (one standard deviation), in the unit of the
  /// metric.
  double standard_uncertainty;
  double k;

  double guard_band_width() const { return k * standard_uncertainty; }
};

/// Acceptance limit of a metric. Its direction, at most or at least, is that of the metric's kind.
struct Gate {
  std::string metric;
  double limit;
  std::optional<GuardBand> guard_band = {};
};

/// Measured metric and its gate, if any.
struct CheckedMetric {
  std::string name;
  std::string unit;
  /// Measured value; std::nullopt if it could not be measured.
  std::optional<double> value;
  /// Limit of the gate; std::nullopt if the metric has no gate.
  std::optional<double> limit;
  Direction direction;
  std::optional<GuardBand> guard_band = {};
  /// Metric::interval_low, which the gate then limits instead of the value.
  std::optional<double> interval_low = {};

  /// Returns the limit tightened by its guard band.
  /// @pre there is a gate
  double acceptance_limit() const;
  /// Returns true if the gate is passed, or if there is none. A gate without a value is not passed.
  bool has_passed_gate() const;
  /// Returns the probability that the true value is within the limit, given only the measured
  /// value (JCGM 106:2012, section 7). Metrics are not negative, and the measured value of an
  /// absolute value is folded at zero:
  ///   Phi((limit - value) / u) - Phi(-(limit + value) / u),   at most
  ///   Phi((value - limit) / u) + Phi(-(limit + value) / u),   at least
  /// The second term matters for values within some u of zero. Returns std::nullopt without a
  /// value, a limit or a guard band.
  std::optional<double> conformance_probability() const;
};

/// Describes the metrics and what each requires, one line each, for humans.
std::string describe_metrics(const std::vector<MetricKind>& known);

/// Parses "NAME=VALUE".
/// @throws std::invalid_argument with the valid names, if no kind has the name
/// @throws std::invalid_argument if the value is not a number from 0 to the kind's largest
Gate parse_gate(const std::string& text, const std::vector<MetricKind>& known);

/// Parses several "NAME=VALUE".
/// @throws std::invalid_argument as parse_gate(), and if a name is repeated
std::vector<Gate> parse_gates(const std::vector<std::string>& texts,
                              const std::vector<MetricKind>& known);

/// Reads {NAME: LIMIT}, in the order of the kinds.
/// @throws InputError if a name or limit is invalid as in parse_gate(), or if there is no gate
std::vector<Gate> read_gates(const YamlValue& value, const std::vector<MetricKind>& known);

/// Reads `vlp-gates/1`:
///   format: vlp-gates/1
///   gates: {mean_mm: 1, p90_mm: 2, missing_fraction: 0}
std::vector<Gate> read_gates(const std::filesystem::path& file,
                             const std::vector<MetricKind>& known);

/// Returns the gates with the limits of `changes`, and with the gates of `changes` on other metrics
/// appended. Guard bands are kept.
std::vector<Gate> merge_gates(std::vector<Gate> gates, const std::vector<Gate>& changes);

/// Returns the metrics with gates, in the order of the gates.
/// @pre here and below: the metric of each gate exists (find_metric_kind())
std::vector<CheckedMetric> check_gates(const std::vector<Gate>& gates,
                                       const std::vector<Metric>& metrics);

/// Returns all metrics, with and without gates, and the gates whose metric was not measured. They
/// are in the order of the kinds.
std::vector<CheckedMetric> check_against_gates(const std::vector<Gate>& gates,
                                               const std::vector<Metric>& metrics,
                                               const std::vector<MetricKind>& known);

/// Describes a gate, for example "mean_mm is 1.25 mm, at most 1 mm is required". With a guard
/// band, "less a guard band of 0.04 mm" follows the limit.
/// @pre there is a gate
std::string describe_gate(const CheckedMetric& gate);

/// Returns " less a guard band of 0.04 mm", or " and ..." for lower limits; empty without a guard
/// band.
std::string describe_guard_band(const CheckedMetric& gate);

/// Returns describe_gate() for all gates that are not passed, separated by "; ".
std::string describe_failed_gates(const std::vector<CheckedMetric>& gates);

/// Returns the probable cause of a failed gate, followed by describe_gate();
/// describe_gate() alone if the metric was not measured.
std::string describe_failed_gate(const CheckedMetric& gate);

}  // namespace vlp
