// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_formats.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "captures/csv_writer.h"
#include "captures/id.h"
#include "captures/number_text.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/station_config.h"

namespace vlp {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDigits = 9;
constexpr const char* kRunFormat = "vlp-run/1";
constexpr std::size_t kMaxRunFileBytes = 64 << 20;

std::string join_lines(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  std::string joined;
  for (const char c : text) joined += c == '\n' ? std::string("; ") : std::string(1, c);
  return joined;
}

/// Returns list_unit_metrics() and the other metrics of these runs.
std::vector<MetricKind> list_columns(const std::vector<RunRecord>& runs) {
  auto kinds = list_unit_metrics();
  for (const MetricKind& kind : list_metric_kinds({MetricSource::evaluation})) {
    const auto has_kind = [&](const RunRecord& run) {
      return run.find_metric(kind.name) != nullptr;
    };
    if (std::ranges::any_of(runs, has_kind)) kinds.push_back(kind);
  }
  return kinds;
}

void write_csv(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  const auto kinds = list_columns(runs);
  std::vector<std::string> header;
  for (const RunField& field : list_run_text_fields()) {
    if (field.in_csv) header.emplace_back(field.name);
  }
  for (const MetricKind& kind : kinds) header.emplace_back(kind.name);
  CsvWriter csv(file, header);
  for (const RunRecord& run : runs) {
    std::vector<std::string> row;
    for (const RunField& field : list_run_text_fields()) {
      if (field.in_csv) row.push_back(join_lines(run.*field.text));
    }
    for (const MetricKind& kind : kinds) {
      const CheckedMetric* metric = run.find_metric(kind.name);
      const bool has_value = metric != nullptr && metric->value;
      row.push_back(has_value ? format_significant_digits(*metric->value, kDigits) : "");
    }
    csv.row(row);
  }
  csv.save_file();
}

Json json_number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

void add_guard_band(const CheckedMetric& metric, Json& json) {
  if (!metric.guard) return;
  json["uncertainty"] = metric.guard->standard_uncertainty;
  json["guard_k"] = metric.guard->k;
}

/// Adds the images and the events of a run.
void add_images_and_events(const RunRecord& run, Json& json) {
  json["images"] = Json::array();
  for (const auto& [step, name, sha256, refused] : run.images) {
    json["images"].push_back(
        {{"step", step}, {"image", name}, {"sha256", sha256}, {"refused", refused}});
  }
  json["events"] = Json::array();
  for (const RunEvent& event : run.events) {
    json["events"].push_back(
        {{"event", event.event}, {"what", event.what}, {"text", event.text}, {"who", event.who}});
  }
}

Json to_json(const RunRecord& run) {
  Json json;
  for (const RunField& field : list_run_text_fields()) {
    json[field.name] = field.in_csv ? join_lines(run.*field.text) : run.*field.text;
  }
  json["figures"] = Json::object();
  for (const CheckedMetric& metric : run.metrics) {
    Json& figure = json["figures"][metric.name];
    figure = {{"value", json_number_or_null(metric.value)},
              {"unit", metric.unit},
              {"gate", json_number_or_null(metric.limit)},
              {"at_least", metric.direction == Direction::at_least},
              {"passed", metric.has_passed()}};
    add_guard_band(metric, figure);
    if (metric.guard) {
      figure["conformance_probability"] = json_number_or_null(metric.conformance_probability());
    }
  }
  add_images_and_events(run, json);
  return json;
}

std::optional<double> read_optional_number(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

std::optional<GuardBand> read_guard_band(const Json& metric) {
  if (!metric.contains("guard_k")) return std::nullopt;
  return GuardBand{metric.at("uncertainty").get<double>(), metric.at("guard_k").get<double>()};
}

SpooledRun parse_run(const Json& json) {
  if (json.at("format").get<std::string>() != kRunFormat)
    throw std::runtime_error("another format");
  SpooledRun spooled;
  json.at("records").get_to(spooled.records);
  RunRecord& run = spooled.run;
  for (const RunField& field : list_run_text_fields()) {
    run.*field.text = json.value(field.name, std::string());
  }
  if (run.run.empty() || run.verdict.empty()) throw std::runtime_error("no run, or no verdict");
  // Both name folders and files.
  for (const std::string& id : {run.run, run.camera}) {
    if (!Id::is_valid_id(id)) throw std::runtime_error("its run or camera is no id");
  }
  for (const Json& metric : json.at("figures")) {
    run.metrics.push_back(
        {find_present_metric_name(metric.at("name")), metric.at("unit"),
         read_optional_number(metric.at("value")), read_optional_number(metric.at("gate")),
         metric.at("at_least").get<bool>() ? Direction::at_least : Direction::at_most,
         read_guard_band(metric)});
  }
  for (const Json& image : json.at("images")) {
    run.images.push_back(
        {image.at("step"), image.at("image"), image.at("sha256"), image.at("refused")});
  }
  for (const Json& event : json.value("events", Json::array())) {
    run.events.push_back(
        {event.at("event"), event.at("what"), event.at("text"), event.value("who", "")});
    if (!Id::is_valid_id(run.events.back().event)) throw std::runtime_error("an event is no id");
  }
  return spooled;
}

/// Serializes JSON; replaces bytes that are no UTF-8.
std::string serialize(const Json& json) {
  constexpr int indent = 1;
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string serialize_run(const SpooledRun& spooled) {
  const RunRecord run = escape_run_texts(spooled.run);
  Json json;
  json["format"] = kRunFormat;
  json["records"] = escape_for_single_line(spooled.records);
  for (const RunField& field : list_run_text_fields()) json[field.name] = run.*field.text;
  json["figures"] = Json::array();
  for (const CheckedMetric& metric : run.metrics) {
    json["figures"].push_back({{"name", metric.name},
                               {"unit", metric.unit},
                               {"value", json_number_or_null(metric.value)},
                               {"gate", json_number_or_null(metric.limit)},
                               {"at_least", metric.direction == Direction::at_least}});
    add_guard_band(metric, json["figures"].back());
  }
  add_images_and_events(run, json);
  return serialize(json);
}

SpooledRun read_spooled_run(const std::filesystem::path& file) {
  const auto text =
      SharedFolder(file.parent_path()).read(file.filename().string(), kMaxRunFileBytes);
  if (!text) throw InputError(file, "cannot be opened: it was removed");
  try {
    check_json_size_and_depth(*text);
    return parse_run(Json::parse(*text));
  } catch (const std::exception& error) {
    throw InputError(file, std::string("is no run of a station: ") + error.what());
  }
}

std::string format_hook_json(const RunRecord& run) {
  Json json;
  json["event"] = find_voiding_event(run) != nullptr ? "voided" : "verdict";
  json.update(to_json(run));
  return serialize(json);
}

void export_runs_to_file(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  if (file.extension() == ".csv") return write_csv(file, runs);
  if (file.extension() != ".json") throw InputError(file, "should end in .csv or .json");
  Json all = Json::array();
  for (const RunRecord& run : runs) all.push_back(to_json(run));
  write_file(file, serialize(all));
}

}  // namespace vlp
