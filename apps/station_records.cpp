// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_records.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "app.h"
#include "rig/input_error.h"
#include "station/control_chart.h"
#include "station/export_runs.h"
#include "station/station_config.h"
#include "station/station_screen.h"

namespace vlp {
namespace {

Records records_of(const StationRecordsOptions& options) {
  if (options.station.empty() == options.records.empty()) {
    throw std::invalid_argument("which records? Give --station or --records");
  }
  const std::string where =
      options.records.empty() ? read_station(options.station).records : options.records;
  const bool is_server = where.find("://") != std::string::npos;
  if (!is_server && !std::filesystem::exists(where))
    throw InputError(where, "there are no records");
  return Records(where);
}

/// The run that is named, or the last that the filter lets through.
RunRecord run_of(Records& records, const StationRecordsOptions& options) {
  std::string run = options.run;
  if (run.empty()) {
    const auto runs = records.list(options.filter);
    if (runs.empty()) throw std::invalid_argument("there is no such run");
    run = runs.back().run;
  }
  auto record = records.find(run);
  if (!record) throw std::invalid_argument("there is no run " + run);
  return *record;
}

}  // namespace

void list_runs(const StationRecordsOptions& options) {
  Records records = records_of(options);
  const auto runs = records.list(options.filter);
  fmt::print("{:<34} {:<20} {:<8} {:<7} {}\n", "run", "ended (UTC)", "verdict", "kind", "camera");
  for (const RunSummary& run : runs) {
    fmt::print("{:<34} {:<20} {:<8} {:<7} {}\n", run.run, run.ended_utc, run.verdict, run.kind,
               run.camera);
  }
  const auto passed = std::count_if(runs.begin(), runs.end(),
                                    [](const auto& run) { return run.verdict == "PASS"; });
  fmt::print("\n{} runs, {} passed\n", runs.size(), passed);
}

void show_run(const StationRecordsOptions& options) {
  Records records = records_of(options);
  const RunRecord record = run_of(records, options);
  for (const ScreenLine& line : verdict_screen(record)) fmt::print("{}\n", line.text);
  fmt::print("\nfigures without a gate\n");
  for (const CheckedMetric& figure : record.figures) {
    if (figure.limit || !figure.value) continue;
    fmt::print("{:<24}{:>12.4g} {}\n", figure.name, *figure.value, figure.unit);
  }
  const auto used = std::count_if(record.images.begin(), record.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  fmt::print("\n");
  for (const RunField& field : run_fields()) {
    if (field.label != nullptr) fmt::print("{:<11}{}\n", field.label, record.*field.text);
  }
  fmt::print("images     {}, {} used\n", record.images.size(), used);
}

void export_runs(const StationRecordsOptions& options) {
  Records records = records_of(options);
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records.list(options.filter)) {
    if (auto record = records.find(run.run)) runs.push_back(std::move(*record));
  }
  write_runs(options.output, runs);
  fmt::print("{} runs\n", runs.size());
}

void show_trend(const StationRecordsOptions& options) {
  const auto kinds = unit_metrics();
  if (std::none_of(kinds.begin(), kinds.end(),
                   [&](const auto& kind) { return kind.name == options.figure; })) {
    std::string names;
    for (const MetricKind& kind : kinds) names.append(names.empty() ? "" : ", ").append(kind.name);
    throw std::invalid_argument("there is no figure " + options.figure + "; there are: " + names);
  }
  Records records = records_of(options);
  const auto points = records.trend(options.figure, options.filter);
  constexpr std::size_t least = 2;
  if (points.size() < least) {
    throw Undetermined(
        fmt::format("{} of the runs have {}: a trend needs two", points.size(), options.figure));
  }
  std::vector<double> values;
  values.reserve(points.size());
  for (const TrendPoint& point : points) values.push_back(point.value);
  const ControlChart chart = control_chart(values);
  if (!options.output.empty()) draw_trend(options.output, options.figure, points);
  fmt::print("{} of {} runs\nmean      {:.4g}\nlimits    {:.4g} to {:.4g}\n", options.figure,
             points.size(), chart.mean, chart.lower, chart.upper);
  for (const std::size_t i : chart.outside) {
    fmt::print("outside   {} {} {:.4g}\n", points[i].run, points[i].camera, values[i]);
  }
  for (const std::size_t i : chart.drifting) {
    fmt::print("drift     {} {} {:.4g}: the eighth or more in a row on one side\n", points[i].run,
               points[i].camera, values[i]);
  }
}

}  // namespace vlp
