// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/check_gates.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "captures/csv_writer.h"
#include "evaluation/known_gates.h"
#include "rig/yaml_reader.h"

namespace vlp {
namespace {

const KnownGate* known(const std::string& name) {
  const auto all = known_gates();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const KnownGate& gate) { return gate.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::string names() {
  std::string all;
  for (const KnownGate& gate : known_gates()) all.append(all.empty() ? "" : ", ").append(gate.name);
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
  for (const KnownGate& gate : known_gates()) {
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
  for (const KnownGate& gate : known_gates()) {
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

std::string words_of(const GateResult& gate) {
  constexpr int digits = 4;
  const std::string unit = gate.unit.empty() ? "" : " " + gate.unit;
  const bool known = std::isfinite(gate.value);
  return gate.name + " is " + (known ? significant(gate.value, digits) + unit : "not known") +
         ", at most " + significant(gate.limit, digits) + unit + " is asked for";
}

}  // namespace vlp
