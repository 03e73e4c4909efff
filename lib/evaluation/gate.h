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

/// By how much more than its limit asks a metric has to be good, because it is measured with an
/// uncertainty (guarded acceptance, JCGM 106:2012, section 8.3.2): it is accepted up to limit - k
/// u, or from limit + k u on. Metrics that are at the limit in truth are accepted with the
/// probability 1 - Phi(k): 0.05 with k = 1.645 (ISO 14253-1), 0.023 with 2.
struct GuardBand {
  /// u, in the metric's unit.
  double standard_uncertainty;
  double k;

  double width() const { return k * standard_uncertainty; }
};

/// What a metric has to be at most, or at least, whichever its kind says.
struct Gate {
  std::string metric;
  double limit;
  std::optional<GuardBand> guard = {};
};

/// A metric, as it was measured, and its gate.
struct CheckedMetric {
  std::string name;
  std::string unit;
  /// Nothing where it could not be measured.
  std::optional<double> value;
  /// Nothing when it is no gate.
  std::optional<double> limit;
  Direction asked;
  std::optional<GuardBand> guard = {};

  /// The limit, its guard band taken off. Precondition: it is a gate.
  double acceptance_limit() const;
  /// A gate without a value is not met.
  bool met() const;
  /// Of the metric being within its limit in truth, when nothing but its value is known of it:
  /// Phi((limit - value) / u), or Phi((value - limit) / u) (JCGM 106:2012, section 7). Nothing
  /// without a value, a limit or a guard band.
  std::optional<double> conformance_probability() const;
};

/// The metrics, with what each needs, a line for each, for people.
std::string gate_descriptions(const std::vector<MetricKind>& known);

/// The gate that "NAME=VALUE" says. Throws std::invalid_argument when no kind has the name (and
/// says which there are), or when the value is not a number from 0 to the kind's largest.
Gate gate_of(const std::string& text, const std::vector<MetricKind>& known);

/// Of several such texts. Throws std::invalid_argument, too, when one stands twice.
std::vector<Gate> gates_of(const std::vector<std::string>& texts,
                           const std::vector<MetricKind>& known);

/// Reads {NAME: LIMIT}, in the order of the kinds. Throws InputError: a name or a limit that
/// gate_of() would refuse, no gate.
std::vector<Gate> read_gates(const YamlValue& value, const std::vector<MetricKind>& known);

/// Reads `vlp-gates/1`:
///   format: vlp-gates/1
///   gates: {mean_mm: 1, p90_mm: 2, missing: 0}
std::vector<Gate> read_gates(const std::filesystem::path& file,
                             const std::vector<MetricKind>& known);

/// The gates, those of `changes` in place of those of the same metric.
std::vector<Gate> with_changes(std::vector<Gate> gates, const std::vector<Gate>& changes);

/// In the order of the gates. Precondition, here and below: gates are of kinds that there are.
std::vector<CheckedMetric> check_gates(const std::vector<Gate>& gates,
                                       const std::vector<Metric>& metrics);

/// All metrics, with gates and without, and gates whose metric was not measured; in the order of
/// the kinds.
std::vector<CheckedMetric> check_all(const std::vector<Gate>& gates,
                                     const std::vector<Metric>& metrics,
                                     const std::vector<MetricKind>& known);

/// For example "mean_mm is 1.25 mm, at most 1 mm is asked for", or "at most 1 mm less a guard band
/// of 0.04 mm". Precondition: it is a gate.
std::string words_of(const CheckedMetric& gate);

/// " less a guard band of 0.04 mm", or " and ..."; empty without one.
std::string words_of_guard(const CheckedMetric& gate);

/// words_of() of those that are not met, with "; " between them.
std::string words_of_missed(const std::vector<CheckedMetric>& gates);

/// Returns what it means that a gate is not met, then words_of() it; of a metric that was not
/// measured words_of() alone.
std::string cause_of(const CheckedMetric& gate);

}  // namespace vlp
