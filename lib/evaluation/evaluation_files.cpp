// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "captures/digest.h"
#include "evaluation/gate.h"
#include "geometry/angles.h"
#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

using Json = nlohmann::ordered_json;

/// Unit of keys and the factor that converts SI values to it.
struct KeyUnit {
  const char* suffix;
  double factor;
};
const KeyUnit kMmKeys{"_mm", 1e3};
const KeyUnit kDegKeys{"_deg", deg_from_rad(1)};

Json to_json(const ErrorStatistics& statistics, const KeyUnit& unit) {
  const auto key = [&](const char* name) { return name + std::string(unit.suffix); };
  return {{key("mean"), unit.factor * statistics.mean},
          {key("median"), unit.factor * statistics.median},
          {key("p90"), unit.factor * statistics.p90},
          {key("max"), unit.factor * statistics.max},
          {key("rms"), unit.factor * statistics.rms}};
}

Json to_json(const SignedErrorStatistics& statistics, const KeyUnit& unit) {
  Json json = to_json(statistics.magnitudes, unit);
  json["bias" + std::string(unit.suffix)] = unit.factor * statistics.bias;
  json["fixes"] = statistics.magnitudes.count;
  return json;
}

Json to_json(const Interval& interval, double factor = kMmKeys.factor) {
  return {factor * interval.low, factor * interval.high};
}

Json to_json(const std::vector<std::pair<double, double>>& distribution_m) {
  Json points = Json::array();
  for (const auto& [fraction, error_m] : distribution_m) {
    points.push_back({{"fraction", fraction}, {"error_mm", kMmKeys.factor * error_m}});
  }
  return points;
}

Json to_json(const BiasAndRepeatability& statistics) {
  Json list = Json::array();
  for (const auto& station : statistics.reference_points) {
    list.push_back({{"x_m", station.xy_m.x()},
                    {"y_m", station.xy_m.y()},
                    {"fixes", station.fixes},
                    {"bias_x_mm", kMmKeys.factor * station.bias_m.x()},
                    {"bias_y_mm", kMmKeys.factor * station.bias_m.y()},
                    {"sd_mm", kMmKeys.factor * station.sd_m}});
  }
  return {{"reference_points", statistics.reference_points.size()},
          {"fixes", statistics.fixes},
          {"bias_mm", kMmKeys.factor * statistics.bias_m},
          {"repeatability_mm", kMmKeys.factor * statistics.repeatability_m},
          {"list", list}};
}

Json to_json(const LineFit& fit) {
  Json json = to_json(fit.distances_m, kMmKeys);
  json["jitter_mm"] = kMmKeys.factor * fit.jitter_m;
  json["angle_deg"] = deg_from_rad(fit.angle_rad);
  for (const auto& [key, end] : {std::pair("begin", fit.line_m[0]), {"end", fit.line_m[1]}}) {
    json[key] = {{"x_m", end.x()}, {"y_m", end.y()}};
  }
  json["cdf"] = to_json(fit.distribution_m);
  return json;
}

Json to_json(const NormalizedErrors& normalized_errors) {
  const auto& [horizontal, fixes, height, yaw] = normalized_errors;
  Json json{{"horizontal", horizontal.rms},
            {"horizontal_low", horizontal.low},
            {"within_95", horizontal.within_95},
            {"fixes", fixes}};
  const auto add = [&](const std::string& name, const std::optional<NormalizedError>& error) {
    if (!error) return;
    json[name] = error->rms;
    json[name + "_low"] = error->low;
    json[name + "_within_95"] = error->within_95;
  };
  add("height", height);
  add("yaw", yaw);
  return json;
}

Json to_json(const QuantityComparison& comparison, const ComparedQuantity& quantity) {
  const auto key = [&](const std::string& name) {
    return *quantity.unit == 0 ? name : name + "_" + quantity.unit;
  };
  Json json{{"verdict", comparison.comparison_verdict()},
            {"pairs", comparison.pairs},
            {"clusters", comparison.clusters},
            {"smaller_errors", comparison.smaller},
            {"larger_errors", comparison.larger}};
  if (comparison.pairs > 0) {
    json[key("mean_difference")] = quantity.units_per_si * comparison.mean_difference;
  }
  json[key("min_relevant_difference")] = quantity.units_per_si * comparison.min_relevant;
  if (comparison.has_too_few_clusters()) json["reason"] = "too few clusters";
  if (comparison.interval)
    json[key("interval_95")] = to_json(*comparison.interval, quantity.units_per_si);
  return json;
}

Json to_json(const Comparison& comparison) {
  Json json{{"verdict", comparison.comparison_verdict()},
            {"only_in_fixes", comparison.only_in_fixes},
            {"only_in_compared", comparison.only_in_other_fixes},
            {"unpaired", comparison.unpaired}};
  for (std::size_t i = 0; const ComparedQuantity& quantity : list_compared_quantities()) {
    const QuantityComparison& compared = comparison.quantities[i++];
    if (i == 1 || compared.pairs > 0) json[quantity.key] = to_json(compared, quantity);
  }
  return json;
}

Json to_json(const std::vector<CheckedMetric>& gates) {
  Json list = Json::array();
  for (const CheckedMetric& gate : gates) {
    list.push_back({{"name", gate.name},
                    {"unit", gate.unit},
                    {"value", gate.value ? Json(*gate.value) : Json(nullptr)},
                    {"limit", gate.limit.value()},
                    {"direction", describe_direction(gate.direction)},
                    {"passed", gate.has_passed_gate()}});
    if (gate.interval_low) list.back()["interval_low"] = *gate.interval_low;
  }
  return list;
}

bool is_gate_failed(const CheckedMetric& gate) { return !gate.has_passed_gate(); }

}  // namespace

std::string format_evaluation(const Evaluation& evaluation,
                              const std::vector<CheckedMetric>& gates) {
  Json json{{"format", "vlp-evaluation/4"},
            {"reference", evaluation.reference},
            {"captures", evaluation.captures},
            {"fixes", evaluation.fixes},
            {"missing_fraction", evaluation.missing_fix_fraction()},
            {"missing", evaluation.failures_by_status},
            {"horizontal", to_json(evaluation.horizontal_m, kMmKeys)}};
  if (const auto& intervals = evaluation.intervals_m) {
    json["horizontal"]["intervals_95"] = {{"resampling_unit", evaluation.resampling_unit},
                                          {"clusters", intervals->clusters},
                                          {"mean_mm", to_json(intervals->mean)},
                                          {"median_mm", to_json(intervals->median)}};
    Json& intervals_json = json["horizontal"]["intervals_95"];
    if (intervals->p90) intervals_json["p90_mm"] = to_json(*intervals->p90);
    intervals_json["rms_mm"] = to_json(intervals->rms);
  }
  json["horizontal"]["cdf"] = to_json(evaluation.distribution_m);
  if (evaluation.height_m) json["height"] = to_json(*evaluation.height_m, kMmKeys);
  if (evaluation.yaw_rad) json["yaw"] = to_json(*evaluation.yaw_rad, kDegKeys);
  if (evaluation.bias_and_repeatability)
    json["bias_and_repeatability"] = to_json(*evaluation.bias_and_repeatability);
  if (evaluation.line_fit) json["fitted_line"] = to_json(*evaluation.line_fit);
  if (evaluation.normalized_errors)
    json["normalized_error_rms"] = to_json(*evaluation.normalized_errors);
  if (evaluation.crlb_ratio) {
    json["crlb"] = {{"ratio", evaluation.crlb_ratio->horizontal},
                    {"rms_mm", kMmKeys.factor * evaluation.crlb_ratio->crlb_m},
                    {"errors_below_crlb", evaluation.crlb_ratio->are_errors_below_crlb()},
                    {"fixes", evaluation.crlb_ratio->fixes}};
  }
  if (evaluation.comparison) json["comparison"] = to_json(*evaluation.comparison);
  json["gates"] = to_json(gates);
  json["passed"] = std::none_of(gates.begin(), gates.end(), is_gate_failed);
  return json.dump(2) + "\n";
}

void check_accepted_fixes(const std::filesystem::path& fixes) {
  constexpr std::size_t max_bytes = 1 << 16;
  const std::filesystem::path origin = fixes.string() + ".origin";
  if (!std::filesystem::exists(origin)) return;
  const std::string wanted = "sha256 " + hash_file(fixes) + "\n";
  if (read_text_file(origin, max_bytes).find(wanted) != std::string::npos) return;
  throw InputError(fixes, "was changed after it was accepted, according to " +
                              origin.filename().string() +
                              "; restore it, or accept fixes with accept-fixes.sh");
}

}  // namespace vlp
