// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/check_gates.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "captures/csv_writer.h"
#include "geometry/angles.h"
#include "rig/yaml_reader.h"

namespace vlp {
namespace {

constexpr double kMm = 1e3;

struct KnownGate {
  const char* name;
  const char* unit;
  const char* what;
  std::optional<double> (*figure)(const Evaluation&);
};

std::optional<double> height_rms_mm(const Evaluation& e) {
  return e.height_m ? std::optional(kMm * e.height_m->sizes.rms) : std::nullopt;
}
std::optional<double> yaw_rms_deg(const Evaluation& e) {
  return e.yaw_rad ? std::optional(deg_from_rad(e.yaw_rad->sizes.rms)) : std::nullopt;
}
std::optional<double> of_stations_mm(const Evaluation& e, double StationFigures::*figure) {
  return e.stations ? std::optional(kMm * (*e.stations).*figure) : std::nullopt;
}
std::optional<double> of_fit_mm(const Evaluation& e, double ErrorFigures::*figure) {
  return e.fit ? std::optional(kMm * e.fit->distances_m.*figure) : std::nullopt;
}
/// The end of the difference's interval that is nearer to better; nothing is certain of too few.
std::optional<double> worse_mm(const Evaluation& e) {
  if (!e.comparison || e.comparison->pairs == 0) return std::nullopt;
  return e.comparison->too_few() ? 0 : kMm * e.comparison->interval_m->low;
}

const std::array kKnown{
    KnownGate{"mean_mm", "mm", "mean horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.mean); }},
    KnownGate{"median_mm", "mm", "median horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.median); }},
    KnownGate{"p90_mm", "mm", "what 90 % of the horizontal errors do not exceed",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.p90); }},
    KnownGate{"max_mm", "mm", "largest horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.max); }},
    KnownGate{"rms_mm", "mm", "root mean square of the horizontal errors",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.rms); }},
    KnownGate{"bias_mm", "mm", "of stations; needs a truth and stations with two fixes or more",
              [](const Evaluation& e) { return of_stations_mm(e, &StationFigures::bias_m); }},
    KnownGate{"scatter_mm", "mm", "within stations; needs the same",
              [](const Evaluation& e) { return of_stations_mm(e, &StationFigures::scatter_m); }},
    KnownGate{"height_rms_mm", "mm", "needs z_m in the truth or the path", height_rms_mm},
    KnownGate{"yaw_rms_deg", "deg", "needs yaw_rad in the truth", yaw_rms_deg},
    KnownGate{"missing", "", "share of the captures without a fix, from 0 to 1",
              [](const Evaluation& e) { return std::optional(e.missing_share()); }},
    KnownGate{"stated_ratio", "", "horizontal errors / stated sd; needs a truth and sd columns",
              [](const Evaluation& e) {
                return e.stated ? std::optional(e.stated->horizontal) : std::nullopt;
              }},
    KnownGate{"limit_ratio", "",
              "horizontal errors / theoretical limit; needs --lamps, --calibration, --noise-px",
              [](const Evaluation& e) {
                return e.limit ? std::optional(e.limit->horizontal) : std::nullopt;
              }},
    KnownGate{"fitted_mean_mm", "mm", "mean distance of the fitted line; needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::mean); }},
    KnownGate{"fitted_p90_mm", "mm", "needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::p90); }},
    KnownGate{"fitted_max_mm", "mm", "needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::max); }},
    KnownGate{"worse_mm", "mm",
              "by how much the mean error is certainly larger than that of --compare (lower end of "
              "the difference's interval): 0 fails on the verdict 'worse'; of fewer "
              "than 20 stations or captures nothing is certain",
              worse_mm},
};

const KnownGate* known(const std::string& name) {
  const auto found = std::find_if(kKnown.begin(), kKnown.end(),
                                  [&](const KnownGate& gate) { return gate.name == name; });
  return found == kKnown.end() ? nullptr : &*found;
}

std::string names() {
  std::string all;
  for (const KnownGate& gate : kKnown) all.append(all.empty() ? "" : ", ").append(gate.name);
  return all;
}

/// What is wrong with a limit; empty when nothing is.
std::string problem_of(const std::string& name, double limit) {
  constexpr int digits = 6;
  if (limit < 0) {
    return "should not be negative, as no figure is to be below zero: " +
           significant(limit, digits);
  }
  if (name == "missing" && limit > 1) {
    return "should be a share from 0 to 1, not " + significant(limit, digits) + ": for " +
           significant(limit, digits) + " % say " + significant(limit / 100, digits);
  }
  return "";
}

}  // namespace

std::string gate_descriptions() {
  constexpr std::size_t width = 16;
  std::string text;
  for (const KnownGate& gate : kKnown) {
    std::string name = gate.name;
    name.resize(width, ' ');
    text.append("  ").append(name).append(gate.what).append("\n");
  }
  return text;
}

Gate gate_of(const std::string& text) {
  const std::size_t sign = text.find('=');
  const std::string name = text.substr(0, sign);
  if (known(name) == nullptr) {
    throw std::invalid_argument("gate '" + name + "' is not known; the gates are: " + names());
  }
  double limit = 0;
  const char* const end = text.data() + text.size();
  const char* const begin = sign == std::string::npos ? end : text.data() + sign + 1;
  const auto [stop, failure] = std::from_chars(begin, end, limit);
  if (failure != std::errc() || stop != end || !std::isfinite(limit)) {
    throw std::invalid_argument("gate '" + text + "' should be NAME=VALUE with a finite number");
  }
  if (const std::string problem = problem_of(name, limit); !problem.empty()) {
    throw std::invalid_argument("gate '" + name + "' " + problem);
  }
  return {name, limit};
}

std::vector<Gate> read_gates(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, "vlp-gates/1");
  const YamlValue entry = document.required("gates");
  document.finish();
  YamlMap map = entry.map();
  std::vector<Gate> gates;
  for (const KnownGate& gate : kKnown) {
    const auto limit = map.optional(gate.name);
    if (!limit) continue;
    gates.push_back({gate.name, limit->number()});
    const std::string problem = problem_of(gate.name, gates.back().limit);
    if (!problem.empty()) throw limit->error(problem);
  }
  map.finish();
  if (gates.empty()) throw entry.error("holds no gate; the gates are: " + names());
  return gates;
}

std::vector<GateResult> check_gates(const std::vector<Gate>& gates, const Evaluation& evaluation) {
  std::vector<GateResult> results;
  results.reserve(gates.size());
  for (const Gate& gate : gates) {
    const KnownGate& figure = *known(gate.name);
    const auto value = figure.figure(evaluation);
    if (!value) {
      throw std::invalid_argument("gate '" + gate.name +
                                  "': there is no such figure here: " + figure.what);
    }
    results.push_back({gate.name, figure.unit, *value, gate.limit, *value <= gate.limit});
  }
  return results;
}

GateResult unmet_gate(const std::string& text) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  return {text, "", none, none, false};
}

std::string words_of(const GateResult& gate) {
  if (gate.is_text()) return gate.name;
  constexpr int digits = 4;
  const std::string unit = gate.unit.empty() ? "" : " " + gate.unit;
  return gate.name + " is " + significant(gate.value, digits) + unit + ", at most " +
         significant(gate.limit, digits) + unit + " is asked for";
}

}  // namespace vlp
