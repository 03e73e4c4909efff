// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_records.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <tuple>

#include "app.h"
#include "captures/printable.h"
#include "rig/input_error.h"
#include "station/control_chart.h"
#include "station/database_name.h"
#include "station/export_runs.h"
#include "station/publish_run.h"
#include "station/spool.h"
#include "station/station_config.h"
#include "station/station_screen.h"

namespace vlp {
namespace {

constexpr const char* kAny = "any";

/// To stdout; what records hold of names is not for the terminal to obey.
void say(const std::string& text) { fmt::print("{}", printable(text)); }

/// What is known of runs: the records, and of a station those that wait for them, which are brought
/// there first.
struct Known {
  std::optional<Spool> spool;
  std::optional<Records> records;
  /// Why the records cannot be asked.
  std::string away = {};

  explicit Known(const StationRecordsOptions& options) {
    if (options.station.empty() == options.records.empty()) {
      throw std::invalid_argument("which records? Give --station or --records");
    }
    std::string where = options.records;
    if (where.empty()) {
      const StationConfig config = read_station(options.station);
      where = config.records;
      spool.emplace(config.spool, where);
      spool->deliver();
    }
    try {
      if (!is_server(where) && !std::filesystem::exists(where)) {
        throw InputError(name_of_database(where), "there are no records");
      }
      records.emplace(where);
    } catch (const InputError& error) {
      away = error.what();
      if (waiting().empty()) throw;
    }
    const std::string state = spool ? spool->state() : "";
    if (!state.empty()) spdlog::warn("{}", printable(state));
  }

  const std::vector<RunRecord>& waiting() {
    static const std::vector<RunRecord> none;
    return spool ? spool->waiting() : none;
  }
  /// For what cannot do without them.
  Records& all() {
    if (!records) throw std::runtime_error(away);
    return *records;
  }
};

/// A filter in which "any" is not asked for.
RunFilter asked(RunFilter filter) {
  for (std::string* text : {&filter.station, &filter.verdict, &filter.kind}) {
    if (*text == kAny) text->clear();
  }
  return filter;
}

bool passes(const RunRecord& run, const RunFilter& filter) {
  const auto is = [](const std::string& text, const std::string& wanted) {
    return wanted.empty() || text == wanted;
  };
  return is(run.camera, filter.camera) && is(run.station, filter.station) &&
         is(run.verdict, filter.verdict) && is(run.kind, filter.kind);
}

/// Of the records, if they answer, and of those that wait; from the first to the last.
std::vector<RunSummary> runs_of(Known& known, const RunFilter& filter) {
  std::vector<RunSummary> runs;
  if (known.records) runs = known.records->list(filter);
  for (const RunRecord& run : known.waiting()) {
    const bool there = std::any_of(runs.begin(), runs.end(),
                                   [&](const RunSummary& other) { return other.run == run.run; });
    if (there || !passes(run, filter)) continue;
    runs.push_back({run.run, run.kind, run.station, run.camera, run.ended_utc, run.verdict,
                    "(waits here) " + run.causes});
  }
  std::stable_sort(runs.begin(), runs.end(), [](const RunSummary& a, const RunSummary& b) {
    return std::tie(a.ended_utc, a.run) < std::tie(b.ended_utc, b.run);
  });
  const auto last = static_cast<std::size_t>(filter.last);
  if (last > 0 && runs.size() > last) {
    runs.erase(runs.begin(), runs.end() - static_cast<std::ptrdiff_t>(last));
  }
  return runs;
}

/// The run that is named, or the last that the filter lets through.
RunRecord run_of(Known& known, const StationRecordsOptions& options) {
  std::string run = options.run;
  if (run.empty()) {
    const auto runs = runs_of(known, asked(options.filter));
    if (runs.empty()) throw std::invalid_argument("there is no such run");
    run = runs.back().run;
  }
  for (const RunRecord& waiting : known.waiting()) {
    if (waiting.run == run) return waiting;
  }
  auto record = known.all().find(run);
  if (!record) throw std::invalid_argument("there is no run " + run);
  return *record;
}

/// What a trend is of unless it is asked for more: units that passed, of the station.
RunFilter comparable(const StationRecordsOptions& options) {
  RunFilter filter = options.filter;
  if (filter.verdict.empty()) filter.verdict = name_of(Verdict::pass);
  if (filter.kind.empty()) filter.kind = "unit";
  if (filter.station.empty() && !options.station.empty()) {
    filter.station = read_station(options.station).station;
  }
  return asked(filter);
}

/// Records that several stations share, when nothing says of which.
void check_one_station(const std::vector<TrendPoint>& points,
                       const StationRecordsOptions& options) {
  if (!options.station.empty() || !options.filter.station.empty()) return;
  for (const TrendPoint& point : points) {
    if (point.station == points.front().station) continue;
    throw std::invalid_argument(
        fmt::format("there are runs of {} and of {}: say of which with "
                    "--of-station, or of all with --of-station any",
                    points.front().station, point.station));
  }
}

}  // namespace

void list_runs(const StationRecordsOptions& options) {
  Known known(options);
  const auto runs = runs_of(known, asked(options.filter));
  constexpr const char* line = "{:<34} {:<20} {:<8} {:<7} {:<12} {:<16} {}\n";
  say(fmt::format(line, "run", "ended (UTC)", "verdict", "kind", "station", "camera", "cause"));
  for (const RunSummary& run : runs) {
    say(fmt::format(line, run.run, run.ended_utc, run.verdict, run.kind, run.station, run.camera,
                    run.causes.substr(0, run.causes.find('\n'))));
  }
  const auto count = [&](Verdict verdict, const std::string& kind) {
    return std::count_if(runs.begin(), runs.end(), [&](const RunSummary& run) {
      return run.verdict == name_of(verdict) && (kind == kAny || run.kind == kind);
    });
  };
  fmt::print("\n{} runs, {} passed, {} failed, {} invalid", runs.size(), count(Verdict::pass, kAny),
             count(Verdict::fail, kAny), count(Verdict::invalid, kAny));
  // Of the units that were judged.
  const auto passed = count(Verdict::pass, "unit"), judged = passed + count(Verdict::fail, "unit");
  constexpr double percent = 100;
  if (judged > 0) {
    fmt::print(": yield {:.1f} % of {}", percent * double(passed) / double(judged), judged);
  }
  fmt::print("\n");
  known.all();  // these are not all there are when the records are away
}

void show_run(const StationRecordsOptions& options) {
  Known known(options);
  const RunRecord record = run_of(known, options);
  for (const ScreenLine& line : verdict_screen(record)) say(fmt::format("{}\n", line.text));
  fmt::print("\nfigures without a gate\n");
  for (const CheckedMetric& figure : record.figures) {
    if (figure.limit || !figure.value) continue;
    say(fmt::format("{:<24}{:>12.4g} {}\n", figure.name, *figure.value, figure.unit));
  }
  const auto used = std::count_if(record.images.begin(), record.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  fmt::print("\n");
  for (const RunField& field : run_fields()) {
    if (field.label != nullptr) say(fmt::format("{:<11}{}\n", field.label, record.*field.text));
  }
  fmt::print("images     {}, {} used\n", record.images.size(), used);
}

void restore_run(const StationRecordsOptions& options) {
  if (options.station.empty() && options.output.empty()) {
    throw std::invalid_argument("where to? Give --station, whose results it goes to, or --output");
  }
  Known known(options);
  const RunRecord record = run_of(known, options);
  const std::string contradiction = contradiction_of(record);
  if (!contradiction.empty()) throw InputError(record.run, contradiction);
  const std::filesystem::path results = options.output.empty()
                                            ? read_station(options.station).results
                                            : std::filesystem::path(options.output);
  say(fmt::format("{}\n", publish_run(record, {}, results).string()));
}

void export_runs(const StationRecordsOptions& options) {
  Known known(options);
  Records& records = known.all();
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records.list(asked(options.filter))) {
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
  Known known(options);
  Records& records = known.all();
  const RunFilter filter = comparable(options);
  const auto points = records.trend(options.figure, filter);
  check_one_station(points, options);
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
    say(fmt::format("outside   {} {} {:.4g}\n", points[i].run, points[i].camera, values[i]));
  }
  for (const std::size_t i : chart.drifting) {
    say(fmt::format("drift     {} {} {:.4g}: the eighth or more in a row on one side\n",
                    points[i].run, points[i].camera, values[i]));
  }
  if (chart.outside.empty() && chart.drifting.empty()) return;
  throw GateNotMet(fmt::format("{}: {} of the runs outside the limits, {} in a drift",
                               options.figure, chart.outside.size(), chart.drifting.size()));
}

}  // namespace vlp
