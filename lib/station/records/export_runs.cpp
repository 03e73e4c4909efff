// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/export_runs.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/records/json_number.h"
#include "station/station_config.h"

namespace vlp {
namespace {

constexpr int kDigits = 9;

std::string join_lines(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  std::string joined;
  for (const char c : text) joined += c == '\n' ? std::string("; ") : std::string(1, c);
  return joined;
}

const CheckedMetric* find_metric(const RunRecord& run, const MetricKind& kind) {
  const auto metric = std::find_if(run.metrics.begin(), run.metrics.end(),
                                   [&](const auto& each) { return each.name == kind.name; });
  return metric == run.metrics.end() ? nullptr : &*metric;
}

/// Returns unit_metrics() and the other metrics of these runs.
std::vector<MetricKind> list_columns(const std::vector<RunRecord>& runs) {
  auto kinds = unit_metrics();
  for (const MetricKind& kind : metric_kinds({MetricSource::evaluation})) {
    const bool has_value = std::any_of(runs.begin(), runs.end(), [&](const RunRecord& run) {
      return find_metric(run, kind) != nullptr;
    });
    if (has_value) kinds.push_back(kind);
  }
  return kinds;
}

void write_csv(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  const auto kinds = list_columns(runs);
  std::vector<std::string> header;
  for (const RunField& field : run_fields()) {
    if (field.in_csv) header.emplace_back(field.name);
  }
  for (const MetricKind& kind : kinds) header.emplace_back(kind.name);
  CsvWriter csv(file, header);
  for (const RunRecord& run : runs) {
    std::vector<std::string> row;
    for (const RunField& field : run_fields()) {
      if (field.in_csv) row.push_back(join_lines(run.*field.text));
    }
    for (const MetricKind& kind : kinds) {
      const CheckedMetric* metric = find_metric(run, kind);
      const bool has_value = metric != nullptr && metric->value;
      row.push_back(has_value ? significant(*metric->value, kDigits) : "");
    }
    csv.row(row);
  }
  csv.save();
}

nlohmann::ordered_json to_json(const RunRecord& run) {
  nlohmann::ordered_json metrics = nlohmann::ordered_json::object();
  for (const CheckedMetric& metric : run.metrics) {
    metrics[metric.name] = {{"value", number_or_null(metric.value)},
                            {"unit", metric.unit},
                            {"gate", number_or_null(metric.limit)},
                            {"at_least", metric.direction == Direction::at_least},
                            {"passed", metric.passed()}};
    if (!metric.guard) continue;
    metrics[metric.name]["uncertainty"] = metric.guard->standard_uncertainty;
    metrics[metric.name]["guard_k"] = metric.guard->k;
    metrics[metric.name]["conformance_probability"] =
        number_or_null(metric.conformance_probability());
  }
  nlohmann::ordered_json images = nlohmann::ordered_json::array();
  for (const auto& [step, name, sha256, refused] : run.images) {
    images.push_back({{"step", step}, {"image", name}, {"sha256", sha256}, {"refused", refused}});
  }
  nlohmann::ordered_json json;
  for (const RunField& field : run_fields()) {
    json[field.name] = field.in_csv ? join_lines(run.*field.text) : run.*field.text;
  }
  json["figures"] = std::move(metrics);
  json["images"] = std::move(images);
  json["events"] = nlohmann::ordered_json::array();
  for (const RunEvent& event : run.events) {
    json["events"].push_back(
        {{"event", event.event}, {"what", event.what}, {"text", event.text}, {"who", event.who}});
  }
  return json;
}

/// Serializes JSON; replaces bytes that are no UTF-8.
std::string serialize(const nlohmann::ordered_json& json) {
  constexpr int indent = 1;
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string format_hook_json(const RunRecord& run) {
  nlohmann::ordered_json json;
  json["event"] = voided(run) != nullptr ? "voided" : "verdict";
  json.update(to_json(run));
  return serialize(json);
}

void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  if (file.extension() == ".csv") return write_csv(file, runs);
  if (file.extension() != ".json") throw InputError(file, "should end in .csv or .json");
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const RunRecord& run : runs) all.push_back(to_json(run));
  write_file(file, serialize(all));
}

}  // namespace vlp
