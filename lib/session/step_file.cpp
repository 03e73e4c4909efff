// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_file.h"

#include <cmath>
#include <exception>
#include <limits>
#include <nlohmann/json.hpp>

#include "captures/json_bounds.h"
#include "captures/shared_folder.h"
#include "rig/file.h"

namespace vlp {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "vlp-step/1";
/// Largest size of a record: a step with 100,000 skipped images and their reasons.
constexpr std::size_t kMaxStepBytes = std::size_t{64} << 20;

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double number_or_nan(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Eigen::Vector2d parse_vector(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}

StepResult parse_result(const Json& json) {
  StepResult result;
  const auto failure = step_failure_from_name(json.at("failure").get<std::string>());
  result.fail(failure.value_or(StepFailure::bad_input), json.at("message").get<std::string>(),
              json.at("file").get<std::string>());
  for (const Json& metric : json.at("metrics")) {
    result.metrics.push_back(
        {metric.at("name").get<std::string>(), number_or_nan(metric.at("value"))});
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

Json to_json(const CheckedMetric& gate) {
  return {{"name", gate.name},
          {"unit", gate.unit},
          {"value", gate.value ? Json(*gate.value) : Json(nullptr)},
          {"limit", gate.limit ? Json(*gate.limit) : Json(nullptr)},
          {"direction", describe(gate.direction)},
          {"passed", gate.passed()}};
}

Json to_json(const StepResult& result) {
  Json json{{"failure", to_string(result.failure)},
            {"message", result.why},
            {"file", result.subject.string()},
            {"metrics", Json::array()},
            {"warnings", result.warnings},
            {"notes", result.notes},
            {"skipped", Json::array()},
            {"rejected_lamps", Json::array()},
            {"lamp_offsets", Json::array()}};
  for (const auto& [name, value] : result.metrics) {
    json["metrics"].push_back({{"name", name}, {"value", number_or_null(value)}});
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
        SharedFolder(file.parent_path()).read(file.filename().string(), kMaxStepBytes);
    if (!text) return std::nullopt;
    check_json_bounds(*text);
    const Json json = Json::parse(*text, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    if (json.at("format").get<std::string>() != kFormat) return std::nullopt;
    return StepRecord{json.at("key").get<std::string>(), json.at("outputs").get<std::string>(),
                      parse_result(json.at("result"))};
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void write_step_record(const std::filesystem::path& file, const StepRecord& step) {
  const Json json{{"format", kFormat},
                  {"key", step.key},
                  {"outputs", step.outputs},
                  {"result", to_json(step.result)}};
  AtomicFileWriter whole(file);
  whole.write(json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  whole.save_unsynced();  // an incomplete record is ignored, and the step runs again
}

}  // namespace vlp
