// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "evaluation/gate.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

using Json = nlohmann::ordered_json;

/// Unit of keys and the factor that converts SI values to it.
struct KeyUnit {
  const char* ending;
  double of_one;
};
const KeyUnit kMmKeys{"_mm", 1e3};
const KeyUnit kDegKeys{"_deg", deg_from_rad(1)};

Json json_of(const ErrorFigures& figures, const KeyUnit& unit) {
  const auto key = [&](const char* name) { return name + std::string(unit.ending); };
  return {{key("mean"), unit.of_one * figures.mean},
          {key("median"), unit.of_one * figures.median},
          {key("p90"), unit.of_one * figures.p90},
          {key("max"), unit.of_one * figures.max},
          {key("rms"), unit.of_one * figures.rms}};
}

Json json_of(const SignedFigures& figures, const KeyUnit& unit) {
  Json json = json_of(figures.sizes, unit);
  json["bias" + std::string(unit.ending)] = unit.of_one * figures.bias;
  json["fixes"] = figures.sizes.count;
  return json;
}

Json json_of(const Interval& interval_m) {
  return {kMmKeys.of_one * interval_m.low, kMmKeys.of_one * interval_m.high};
}

Json json_of(const std::vector<std::pair<double, double>>& distribution_m) {
  Json points = Json::array();
  for (const auto& [share, error_m] : distribution_m) {
    points.push_back({{"share", share}, {"error_mm", kMmKeys.of_one * error_m}});
  }
  return points;
}

Json json_of(const BiasAndScatter& figures) {
  Json list = Json::array();
  for (const auto& station : figures.stations) {
    list.push_back({{"x_m", station.xy_m.x()},
                    {"y_m", station.xy_m.y()},
                    {"fixes", station.fixes},
                    {"bias_x_mm", kMmKeys.of_one * station.bias_m.x()},
                    {"bias_y_mm", kMmKeys.of_one * station.bias_m.y()},
                    {"sd_mm", kMmKeys.of_one * station.sd_m}});
  }
  return {{"stations", figures.stations.size()},
          {"fixes", figures.fixes},
          {"bias_mm", kMmKeys.of_one * figures.bias_m},
          {"scatter_mm", kMmKeys.of_one * figures.scatter_m},
          {"list", list}};
}

Json json_of(const LineFit& fit) {
  Json json = json_of(fit.distances_m, kMmKeys);
  json["jitter_mm"] = kMmKeys.of_one * fit.jitter_m;
  json["angle_deg"] = deg_from_rad(fit.angle_rad);
  for (const auto& [key, end] : {std::pair("begin", fit.line_m[0]), {"end", fit.line_m[1]}}) {
    json[key] = {{"x_m", end.x()}, {"y_m", end.y()}};
  }
  json["cdf"] = json_of(fit.distribution_m);
  return json;
}

Json json_of(const StatedRatio& stated) {
  Json json{{"horizontal", stated.horizontal}, {"fixes", stated.fixes}};
  if (stated.height) json["height"] = *stated.height;
  if (stated.yaw) json["yaw"] = *stated.yaw;
  json["within_95"] = stated.within_95;
  if (stated.height_within_95) json["height_within_95"] = *stated.height_within_95;
  if (stated.yaw_within_95) json["yaw_within_95"] = *stated.yaw_within_95;
  return json;
}

Json json_of(const Comparison& comparison) {
  Json json{{"verdict", comparison.verdict()},
            {"pairs", comparison.pairs},
            {"units", comparison.units},
            {"only_these", comparison.only_these},
            {"only_others", comparison.only_others},
            {"smaller_errors", comparison.smaller},
            {"larger_errors", comparison.larger}};
  if (comparison.pairs > 0) {
    json["mean_difference_mm"] = kMmKeys.of_one * comparison.mean_difference_m;
  }
  json["least_mm"] = kMmKeys.of_one * comparison.least_m;
  if (comparison.too_few()) json["why"] = "too few";
  if (comparison.interval_m) json["interval_95_mm"] = json_of(*comparison.interval_m);
  return json;
}

Json json_of(const std::vector<CheckedMetric>& gates) {
  Json list = Json::array();
  for (const CheckedMetric& gate : gates) {
    list.push_back({{"name", gate.name},
                    {"unit", gate.unit},
                    {"value", gate.value ? Json(*gate.value) : Json(nullptr)},
                    {"limit", gate.limit.value()},
                    {"asked", words_of(gate.asked)},
                    {"passed", gate.met()}});
  }
  return list;
}

bool failed(const CheckedMetric& gate) { return !gate.met(); }

}  // namespace

std::string json_of(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates) {
  Json json{{"format", "vlp-evaluation/1"},
            {"against", evaluation.against},
            {"captures", evaluation.captures},
            {"fixes", evaluation.fixes},
            {"missing_share", evaluation.missing_share()},
            {"missing", evaluation.missing},
            {"horizontal", json_of(evaluation.horizontal_m, kMmKeys)}};
  if (const auto& intervals = evaluation.intervals_m) {
    json["horizontal"]["intervals_95"] = {{"drawn", evaluation.drawn},
                                          {"units", intervals->units},
                                          {"mean_mm", json_of(intervals->mean)},
                                          {"median_mm", json_of(intervals->median)}};
    Json& json_of_intervals = json["horizontal"]["intervals_95"];
    if (intervals->p90) json_of_intervals["p90_mm"] = json_of(*intervals->p90);
    json_of_intervals["rms_mm"] = json_of(intervals->rms);
  }
  json["horizontal"]["cdf"] = json_of(evaluation.distribution_m);
  if (evaluation.height_m) json["height"] = json_of(*evaluation.height_m, kMmKeys);
  if (evaluation.yaw_rad) json["yaw"] = json_of(*evaluation.yaw_rad, kDegKeys);
  if (evaluation.stations) json["repeated"] = json_of(*evaluation.stations);
  if (evaluation.fit) json["fitted_line"] = json_of(*evaluation.fit);
  if (evaluation.stated) json["stated_ratio"] = json_of(*evaluation.stated);
  if (evaluation.limit) {
    json["limit"] = {{"ratio", evaluation.limit->horizontal},
                     {"limit_rms_mm", kMmKeys.of_one * evaluation.limit->limit_m},
                     {"beaten", evaluation.limit->beaten()},
                     {"fixes", evaluation.limit->fixes}};
  }
  if (evaluation.comparison) json["comparison"] = json_of(*evaluation.comparison);
  json["gates"] = json_of(gates);
  json["passed"] = std::none_of(gates.begin(), gates.end(), failed);
  return json.dump(2) + "\n";
}

}  // namespace vlp
