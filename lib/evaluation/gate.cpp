// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/gate.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "captures/number_text.h"
#include "rig/yaml_reader.h"

namespace vlp {
namespace {

constexpr int kDigits = 4;

std::string join_names(const std::vector<MetricKind>& known) {
  std::string all;
  for (const MetricKind& kind : known) all.append(all.empty() ? "" : ", ").append(kind.name);
  return all;
}

std::string with_unit(double value, const std::string& unit) {
  return format_digits(value, kDigits) + (unit.empty() ? "" : " " + unit);
}

/// Returns an error message on an invalid limit; empty if it is valid.
std::string describe_limit(const MetricKind& kind, double limit) {
  constexpr int digits = 6;
  const std::string text = format_digits(limit, digits);
  if (limit < 0) return "should not be negative, as no metric is below zero: " + text;
  if (limit == 0 && kind.direction == Direction::at_least) {
    return "should be above 0, which is always met";
  }
  if (limit <= kind.max_limit) return "";
  if (kind.max_limit > 1) {
    return "should be at most " + with_unit(kind.max_limit, kind.unit) + ", not " + text;
  }
  return "should be a fraction from 0 to 1, not " + text +
         (limit > 100 ? "" : ": for " + text + " % say " + format_digits(limit / 100, digits));
}

CheckedMetric check_metric(const MetricKind& kind, const std::vector<Metric>& metrics) {
  CheckedMetric checked{
      kind.name, kind.unit, find_metric_value(metrics, kind.name), {}, kind.direction};
  const auto metric = std::ranges::find(metrics, kind.name, &Metric::name);
  if (metric != metrics.end()) checked.interval_low = metric->interval_low;
  return checked;
}

}  // namespace

double CheckedMetric::acceptance_limit() const {
  const double width = guard_band ? guard_band->guard_band_width() : 0;
  return direction == Direction::at_least ? limit.value() + width : limit.value() - width;
}

bool CheckedMetric::has_passed_gate() const {
  if (!limit) return true;
  if (!value) return false;
  return direction == Direction::at_least ? *value >= acceptance_limit()
                                          : interval_low.value_or(*value) <= acceptance_limit();
}

std::optional<double> CheckedMetric::conformance_probability() const {
  if (!limit || !value || !guard_band) return std::nullopt;
  const auto probability_below = [&](double deviation) {
    return std::erfc(-deviation / guard_band->standard_uncertainty / std::numbers::sqrt2) / 2;
  };
  const double beyond_zero = probability_below(-*limit - *value);
  return direction == Direction::at_least ? probability_below(*value - *limit) + beyond_zero
                                          : probability_below(*limit - *value) - beyond_zero;
}

std::string describe_metrics(const std::vector<MetricKind>& known) {
  std::size_t width = 0;
  for (const MetricKind& kind : known) width = std::max(width, std::string(kind.name).size());
  std::string text;
  for (const MetricKind& kind : known) {
    std::string name = kind.name;
    name.resize(width + 2, ' ');
    text.append("  ").append(name).append(kind.description);
    text.append(kind.direction == Direction::at_least ? ", at least\n" : "\n");
  }
  return text;
}

Gate parse_gate(const std::string& text, const std::vector<MetricKind>& known) {
  const std::size_t sign = text.find('=');
  const std::string name = text.substr(0, sign);
  const auto kind = std::find_if(known.begin(), known.end(),
                                 [&](const MetricKind& each) { return each.name == name; });
  if (kind == known.end()) {
    throw std::invalid_argument("gate '" + name +
                                "' is not known; the gates are: " + join_names(known));
  }
  double limit = 0;
  const char* const end = text.data() + text.size();
  const char* const begin = sign == std::string::npos ? end : text.data() + sign + 1;
  const auto [stop, failure] = std::from_chars(begin, end, limit);
  if (failure != std::errc() || stop != end || !std::isfinite(limit)) {
    throw std::invalid_argument("gate '" + text + "' should be NAME=VALUE with a finite number");
  }
  if (const std::string problem = describe_limit(*kind, limit); !problem.empty()) {
    throw std::invalid_argument("gate '" + name + "' " + problem);
  }
  return {name, limit};
}

std::vector<Gate> parse_gates(const std::vector<std::string>& texts,
                              const std::vector<MetricKind>& known) {
  std::vector<Gate> gates;
  for (const std::string& text : texts) {
    Gate gate = parse_gate(text, known);
    for (const Gate& other : gates) {
      if (other.metric != gate.metric) continue;
      throw std::invalid_argument("gate '" + gate.metric + "' occurs twice");
    }
    gates.push_back(std::move(gate));
  }
  return gates;
}

std::vector<Gate> read_gates(const YamlValue& value, const std::vector<MetricKind>& known) {
  YamlMap map = value.read_mapping();
  std::vector<Gate> gates;
  for (const MetricKind& kind : known) {
    const auto limit = map.find(kind.name);
    if (!limit) continue;
    gates.push_back({kind.name, limit->read_number()});
    const std::string problem = describe_limit(kind, gates.back().limit);
    if (!problem.empty()) throw limit->make_error(problem);
  }
  map.check_all_keys_read();
  if (gates.empty())
    throw value.make_error("contains no gate; the gates are: " + join_names(known));
  return gates;
}

std::vector<Gate> read_gates(const std::filesystem::path& file,
                             const std::vector<MetricKind>& known) {
  YamlMap document = read_yaml_file(file, "vlp-gates/1");
  const YamlValue gates = document.require("gates");
  document.check_all_keys_read();
  return read_gates(gates, known);
}

std::vector<Gate> merge_gates(std::vector<Gate> gates, const std::vector<Gate>& changes) {
  for (const Gate& change : changes) {
    const auto same = std::find_if(gates.begin(), gates.end(),
                                   [&](const Gate& gate) { return gate.metric == change.metric; });
    if (same == gates.end()) {
      gates.push_back(change);
    } else {
      same->limit = change.limit;
    }
  }
  return gates;
}

std::vector<CheckedMetric> check_gates(const std::vector<Gate>& gates,
                                       const std::vector<Metric>& metrics) {
  std::vector<CheckedMetric> results;
  results.reserve(gates.size());
  for (const Gate& gate : gates) {
    results.push_back(check_metric(find_metric_kind(gate.metric).value(), metrics));
    results.back().limit = gate.limit;
    results.back().guard_band = gate.guard_band;
  }
  return results;
}

std::vector<CheckedMetric> check_against_gates(const std::vector<Gate>& gates,
                                               const std::vector<Metric>& metrics,
                                               const std::vector<MetricKind>& known) {
  std::vector<CheckedMetric> results;
  for (const MetricKind& kind : known) {
    CheckedMetric result = check_metric(kind, metrics);
    for (const Gate& gate : gates) {
      if (gate.metric != kind.name) continue;
      result.limit = gate.limit;
      result.guard_band = gate.guard_band;
    }
    if (result.value || result.limit) results.push_back(std::move(result));
  }
  return results;
}

std::string describe_gate(const CheckedMetric& gate) {
  return gate.name + " is " + (gate.value ? with_unit(*gate.value, gate.unit) : "not known") +
         (gate.interval_low
              ? " (95 % interval from " + with_unit(*gate.interval_low, gate.unit) + ")"
              : "") +
         ", " + describe_direction(gate.direction) + " " +
         with_unit(gate.limit.value(), gate.unit) + describe_guard_band(gate) + " is required";
}

std::string describe_guard_band(const CheckedMetric& gate) {
  if (!gate.guard_band) return "";
  return std::string(gate.direction == Direction::at_least ? " and" : " less") +
         " a guard band of " + with_unit(gate.guard_band->guard_band_width(), gate.unit);
}

std::string describe_failed_gates(const std::vector<CheckedMetric>& gates) {
  std::string words;
  for (const CheckedMetric& gate : gates) {
    if (!gate.has_passed_gate())
      words.append(words.empty() ? "" : "; ").append(describe_gate(gate));
  }
  return words;
}

std::string describe_failed_gate(const CheckedMetric& gate) {
  if (!gate.value) return describe_gate(gate);
  const auto kind = find_metric_kind(gate.name);
  return std::string(kind ? kind->cause : "a gate is not met") + " (" + describe_gate(gate) + ")";
}

}  // namespace vlp
