// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_file.h"

#include <cmath>
#include <exception>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calibration/error_propagation.h"
#include "calibration/rotation/rotation_fit.h"
#include "captures/shared_folder.h"
#include "evaluation/junit.h"
#include "geometry/angles.h"
#include "rig/calibration_error.h"
#include "rig/file.h"

namespace vlp {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / std::numbers::pi;

Json make_sd_json(const std::optional<Matrix2>& covariance, double factor) {
  if (!covariance) return nullptr;
  return {factor * std::sqrt((*covariance)(0, 0)), factor * std::sqrt((*covariance)(1, 1))};
}

Json make_calibration_json(const Calibration& calibration) {
  const auto& in = calibration.camera.intrinsics;
  Json json{{"lens_model", lens_model_name(calibration.camera.lens_model)},
            {"focal_px", {in[0], in[1]}},
            {"principal_point_px", {in[2], in[3]}}};
  const auto& lens = calibration.intrinsics_report;
  if (lens && lens->covariance) {
    const auto sd_px = [&](Eigen::Index i) { return std::sqrt((*lens->covariance)(i, i)); };
    json["focal_sd_px"] = {sd_px(0), sd_px(1)};
    json["principal_point_sd_px"] = {sd_px(2), sd_px(3)};
  }
  if (const auto& row_time_s = calibration.camera.row_time_s) json["row_time_s"] = *row_time_s;
  if (const auto& center = calibration.rotation_center) {
    const auto [angle_rad, azimuth_rad] = compute_tilt(*center);
    json["rotation_center_px"] = {center->center_px.x(), center->center_px.y()};
    json["rotation_center_sd_px"] = make_sd_json(compute_center_covariance(calibration), 1);
    json["tilt_deg"] = deg_from_rad(angle_rad);
    json["tilt_azimuth_deg"] = deg_from_rad(azimuth_rad);
    const Eigen::Vector2d zenith = compute_zenith_point(*center);
    json["zenith_deg"] = {kDegrees * zenith.x(), kDegrees * zenith.y()};
    json["zenith_sd_deg"] =
        make_sd_json(find_parameter_covariance(calibration, kZenithParameter), kDegrees);
    if (const auto& arm_m = center->lever_arm_m) {
      json["lever_arm_mm"] = {kMillimetersPerMeter * arm_m->x(), kMillimetersPerMeter * arm_m->y()};
      json["lever_arm_sd_mm"] = make_sd_json(
          find_parameter_covariance(calibration, kLeverArmParameter), kMillimetersPerMeter);
    }
  }
  if (const auto& dispersion = calibration.dispersion) {
    json["dispersion_offset_px"] = {dispersion->offset_px.x(), dispersion->offset_px.y()};
    json["dispersion_offset_sd_px"] = make_sd_json(compute_offset_covariance(calibration), 1);
    json["dispersion_radius_mm"] = kMillimetersPerMeter * dispersion->radius_m;
  }
  return json;
}

Json make_history_json(const Calibration& calibration) {
  Json history = Json::array();
  for (const HistoryEntry& entry : calibration.history) {
    Json inputs = Json::array();
    for (const auto& [file, sha256] : entry.inputs) {
      inputs.push_back({{"file", file}, {"sha256", sha256}});
    }
    history.push_back({{"part", entry.part},
                       {"program", entry.program},
                       {"version", entry.version},
                       {"options", entry.options},
                       {"inputs", std::move(inputs)}});
  }
  return history;
}

/// Returns the metrics of all steps, each with its gate if it has one.
Json make_metrics_json(const SessionResult& result) {
  Json metrics = Json::array();
  for (const SessionStep& step : result.steps) {
    const Json of_step = make_step_json(step.result);
    for (Json metric : of_step.at("metrics")) {
      const auto name = metric.at("name").get<std::string>();
      metric["step"] = step.name;
      if (const auto kind = find_metric_kind(name)) {
        metric["unit"] = kind->unit;
      }
      for (const CheckedMetric& gate : step.result.gates) {
        if (gate.name != name) continue;
        const Json of_gate = make_gate_json(gate);
        for (const char* key : {"limit", "direction", "passed"}) metric[key] = of_gate.at(key);
      }
      metrics.push_back(std::move(metric));
    }
  }
  return metrics;
}

constexpr const char* kStepFormat = "vlp-step/1";
/// Largest size of a record: a step with 100,000 skipped images and their reasons.
constexpr std::size_t kMaxStepBytes = std::size_t{64} << 20;

Json json_number_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
double number_or_nan(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Eigen::Vector2d parse_vector(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}

StepResult parse_result(const Json& json) {
  StepResult result;
  const auto failure = failure_from_name(json.at("failure").get<std::string>());
  result.set_step_failure(failure.value_or(StepFailure::bad_input),
                          json.at("message").get<std::string>(),
                          json.at("file").get<std::string>());
  for (const Json& metric : json.at("metrics")) {
    result.metrics.push_back(
        {metric.at("name").get<std::string>(), number_or_nan(metric.at("value")), {}});
    if (metric.contains("interval_low"))
      result.metrics.back().interval_low = metric.at("interval_low").get<double>();
  }
  json.at("warnings").get_to(result.warnings);
  json.at("notes").get_to(result.notes);
  for (const Json& image : json.at("skipped")) {
    result.skipped.push_back(
        {image.at("image").get<std::string>(), image.at("reason").get<std::string>()});
  }
  for (const Json& lamp : json.at("rejected_lamps")) {
    result.rejected_lamps.push_back({lamp.at("lamp").get<int>(), lamp.at("captures").get<int>()});
  }
  for (const Json& lamp : json.at("lamp_offsets")) {
    result.lamp_offsets.push_back({lamp.at("lamp").get<int>(), lamp.at("captures").get<int>(),
                                   parse_vector(lamp.at("map_m")),
                                   parse_vector(lamp.at("offset_mm")) / kMillimetersPerMeter,
                                   parse_vector(lamp.at("offset_sd_mm")) / kMillimetersPerMeter});
  }
  return result;
}

}  // namespace

Json make_gate_json(const CheckedMetric& gate) {
  Json json{{"name", gate.name},
            {"unit", gate.unit},
            {"value", gate.value ? Json(*gate.value) : Json(nullptr)},
            {"limit", gate.limit ? Json(*gate.limit) : Json(nullptr)},
            {"direction", describe_direction(gate.direction)},
            {"passed", gate.has_passed_gate()}};
  if (gate.interval_low) json["interval_low"] = *gate.interval_low;
  return json;
}

Json make_step_json(const StepResult& result) {
  Json json{{"failure", step_failure_name(result.failure)},
            {"message", result.message},
            {"file", result.file_to_correct.string()},
            {"metrics", Json::array()},
            {"warnings", result.warnings},
            {"notes", result.notes},
            {"skipped", Json::array()},
            {"rejected_lamps", Json::array()},
            {"lamp_offsets", Json::array()}};
  for (const auto& [name, value, interval_low] : result.metrics) {
    json["metrics"].push_back({{"name", name}, {"value", json_number_or_null(value)}});
    if (interval_low) json["metrics"].back()["interval_low"] = *interval_low;
  }
  for (const auto& [image, reason] : result.skipped) {
    json["skipped"].push_back({{"image", image}, {"reason", reason}});
  }
  for (const auto& [lamp, captures] : result.rejected_lamps) {
    json["rejected_lamps"].push_back({{"lamp", lamp}, {"captures", captures}});
  }
  for (const auto& [lamp, captures, map_m, offset_m, sd_m] : result.lamp_offsets) {
    json["lamp_offsets"].push_back(
        {{"lamp", lamp},
         {"captures", captures},
         {"map_m", {map_m.x(), map_m.y()}},
         {"offset_mm", {kMillimetersPerMeter * offset_m.x(), kMillimetersPerMeter * offset_m.y()}},
         {"offset_sd_mm", {kMillimetersPerMeter * sd_m.x(), kMillimetersPerMeter * sd_m.y()}}});
  }
  return json;
}

std::optional<StepRecord> read_step_record(const std::filesystem::path& file) {
  try {
    const auto text =
        SharedFolder(file.parent_path()).read_if_exists(file.filename().string(), kMaxStepBytes);
    if (!text) return std::nullopt;
    check_json_limits(*text);
    const Json json = Json::parse(*text, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    if (json.at("format").get<std::string>() != kStepFormat) return std::nullopt;
    return StepRecord{json.at("key").get<std::string>(), json.at("outputs").get<std::string>(),
                      parse_result(json.at("result"))};
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void write_step_record(const std::filesystem::path& file, const StepRecord& step) {
  const Json json{{"format", kStepFormat},
                  {"key", step.key},
                  {"outputs", step.outputs},
                  {"result", make_step_json(step.result)}};
  AtomicFileWriter whole(file);
  whole.write(json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  whole.save_without_fsync();  // an incomplete record is ignored, and the step runs again
}

std::string format_session(const SessionResult& result, const SessionOptions& options) {
  const bool known = result.calibration.has_value();
  Json json{{"format", "vlp-session/2"},
            {"verdict", verdict_text(result.verdict)},
            {"reason", result.reason},
            {"failure", step_failure_name(result.failure)},
            {"camera", known ? result.calibration->camera.id : options.camera_id},
            {"version", options.program.version},
            {"metrics", make_metrics_json(result)},
            {"gates", Json::array()},
            {"steps", Json::array()}};
  for (const CheckedMetric& gate : result.gates) json["gates"].push_back(make_gate_json(gate));
  for (const SessionStep& step : result.steps) {
    const Json of_step = make_step_json(step.result);
    Json entry{{"name", step.name}, {"failure", of_step.at("failure")}};
    for (const char* key :
         {"message", "warnings", "notes", "skipped", "rejected_lamps", "lamp_offsets"}) {
      if (!of_step.at(key).empty() && of_step.at(key) != "") entry[key] = of_step.at(key);
    }
    json["steps"].push_back(std::move(entry));
  }
  if (known) {
    json["calibration"] = make_calibration_json(*result.calibration);
    json["history"] = make_history_json(*result.calibration);
  }
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string format_session_junit(const SessionResult& result) {
  std::vector<JUnitTest> tests;
  tests.reserve(result.steps.size() + result.gates.size() + 1);
  for (const SessionStep& step : result.steps) {
    JUnitTest test{step.name};
    test.warnings = step.result.warnings;
    if (!step.result.has_succeeded()) {
      test.result = JUnitTest::Result::error;
      test.message = step.result.message;
      test.error_type = step_failure_name(step.result.failure);
    }
    tests.push_back(std::move(test));
  }
  if (result.steps.empty()) {
    tests.push_back({"session", JUnitTest::Result::error, result.reason,
                     std::string(step_failure_name(result.failure))});
  }
  const auto gates = make_gate_tests(result.gates);
  tests.insert(tests.end(), gates.begin(), gates.end());
  return format_junit_xml("vlp-calibrate", tests);
}

}  // namespace vlp
