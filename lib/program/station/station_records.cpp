// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_records.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "captures/printable.h"
#include "program/app.h"
#include "program/progress.h"
#include "rig/input_error.h"
#include "station/records/archive_runs.h"
#include "station/records/certificate.h"
#include "station/records/publish_run.h"
#include "station/records/retention.h"
#include "station/records/run_record.h"
#include "station/records/spool.h"
#include "station/records/void_run.h"
#include "station/statistics/control_chart.h"
#include "station/statistics/run_metrics.h"
#include "station/unit/station_screen.h"

namespace vlp {
namespace {

constexpr const char* kAny = "any";

/// Prints a line to stdout. Escapes control characters, so that names in records can neither add a
/// line nor control the terminal.
void print_line(const std::string& text) { fmt::print("{}\n", escape_for_line(text)); }

/// Runs of a station, or of records alone.
struct KnownRuns {
  std::optional<StationConfig> station;
  Spool runs;

  /// Returns the station; null for records alone.
  const StationConfig* station_config() const { return station ? &*station : nullptr; }
};

/// Opens the runs of a station, of which it first delivers those that wait, or of records alone.
/// Reports the state of the spool. If the records are unavailable, commands that continue with
/// waiting runs report it (warn_if_offline()).
KnownRuns open_runs(const StationRecordsOptions& options) {
  if (options.station.empty() == options.records.empty()) {
    throw std::invalid_argument("the records are not specified; give --station or --records");
  }
  std::optional<StationConfig> station;
  if (!options.station.empty()) station = read_station_config(options.station);
  KnownRuns known{station,
                  station ? Spool(station->spool, station->records) : Spool({}, options.records)};
  known.runs.deliver_waiting();
  try {
    if (known.runs.list_waiting_runs().empty()) known.runs.records_or_throw();
  } catch (const RecordsUnavailable& error) {
    if (error.details != error.what()) spdlog::debug("{}", escape_for_terminal(error.details));
    throw;
  }
  const std::string state = known.runs.describe_state();
  if (!state.empty()) {
    const bool is_online = known.runs.offline_reason().empty();
    spdlog::log(is_online ? spdlog::level::warn : spdlog::level::debug, "{}",
                escape_for_terminal(state));
  }
  return known;
}

/// Reports that a command used the waiting runs because the records are unavailable.
void warn_if_offline(KnownRuns& known) {
  if (known.runs.offline_reason().empty()) return;
  spdlog::warn("{}", escape_for_terminal(known.runs.make_operator_notice()));
}

/// Returns the filter with "any" replaced by no condition.
RunFilter remove_conditions_any(RunFilter filter) {
  for (std::string* text : {&filter.station, &filter.verdict, &filter.kind}) {
    if (*text == kAny) text->clear();
  }
  return filter;
}

/// Returns the filter of the options: runs of --station, unless --of-station is given.
RunFilter filter_by_options(const StationRecordsOptions& options, const KnownRuns& known) {
  RunFilter filter = options.filter;
  if (filter.station.empty() && known.station_config() != nullptr) {
    filter.station = known.station_config()->station;
  }
  return remove_conditions_any(std::move(filter));
}

/// Returns the named run, or the last that the filter accepts.
RunRecord load_selected_run(KnownRuns& known, const StationRecordsOptions& options) {
  std::string name = options.run;
  if (name.empty()) {
    const auto runs = known.runs.list_run_summaries(filter_by_options(options, known));
    if (runs.empty()) throw std::invalid_argument("there is no such run");
    name = runs.back().run;
  }
  RunRecord run = known.runs.require_run(name);
  warn_if_offline(known);
  return run;
}

/// Returns filter_by_options() restricted to units, unless --kind is given.
RunFilter filter_comparable(const StationRecordsOptions& options, const KnownRuns& known) {
  RunFilter filter = filter_by_options(options, known);
  if (options.filter.kind.empty()) filter.kind = "unit";
  return filter;
}

/// Checks that all points are from one station, if neither options nor filter name a station.
void check_one_station(const std::vector<TrendPoint>& points,
                       const StationRecordsOptions& options) {
  if (options.station.empty() && options.filter.station.empty()) check_one_station(points);
}

/// Checks that --output is not an input of the command: the records, station.yaml, or a file named
/// in it.
void check_output_option(const StationRecordsOptions& options, const KnownRuns& known) {
  if (options.output.empty()) return;
  std::vector<std::string> inputs{options.station, options.records};
  if (const StationConfig* station = known.station_config()) {
    inputs.push_back(station->records);
    for (const auto& file : station->inputs) inputs.push_back(file.string());
  }
  check_output_is_no_input(options.output, inputs);
}

/// Returns the folder for the files of a run.
std::filesystem::path require_results_folder(const StationRecordsOptions& options) {
  if (!options.output.empty()) return options.output;
  if (!options.station.empty()) return read_station_config(options.station).results;
  throw std::invalid_argument("the output folder is not specified; give --station or --output");
}

/// Returns the result of a study. Converts std::invalid_argument to Undetermined.
template <typename Study>
auto run_study(const Study& study) {
  try {
    return study();
  } catch (const std::invalid_argument& error) {
    throw Undetermined(error.what());
  }
}

/// Parses reference values UNIT=VALUE. Returns them by unit.
std::map<std::string, double> parse_references(const std::vector<std::string>& texts) {
  std::map<std::string, double> references;
  for (const std::string& text : texts) {
    const auto at = text.rfind('=');
    std::istringstream number(at == std::string::npos ? "" : text.substr(at + 1));
    double value = 0;
    if (at == 0 || !(number >> value) || !number.eof() || !std::isfinite(value)) {
      throw std::invalid_argument("--reference: should be UNIT=VALUE, not " + text);
    }
    if (!references.emplace(text.substr(0, at), value).second) {
      throw std::invalid_argument("--reference: " + text.substr(0, at) + " occurs twice");
    }
  }
  return references;
}

std::string format_estimate_test(const EstimateTest& estimate) {
  return fmt::format("{:>12.4g}{:>12.3g}{:>9.2f}{:>9.4f}   {:.4g} to {:.4g}{}", estimate.value,
                     estimate.standard_error, estimate.t, estimate.p, estimate.low, estimate.high,
                     estimate.is_significant() ? "   shows" : "");
}

/// Prints bias and linearity of a station against reference units.
void print_bias(const MetricKind& kind, const StationRecordsOptions& options) {
  const auto references = parse_references(options.references);
  KnownRuns known = open_runs(options);
  check_output_option(options, known);
  const auto points = load_metric_values(known.runs.records_or_throw(), options.metric,
                                         filter_comparable(options, known));
  check_one_station(points, options);
  const auto values = select_reference_values(points, references);
  std::vector<std::string> units;
  units.reserve(references.size());
  for (const auto& [unit, reference] : references) units.push_back(unit);
  const BiasStudy study = run_study([&] {
    check_no_shared_images(known.runs.records_or_throw(), points,
                           select_study_values(points, units));
    return analyze_bias(values);
  });
  constexpr const char* head = "{:<20}{:>10}{:>6}{:>12}{:>12}{:>9}{:>9}   {}";
  print_line(fmt::format("{}: bias against {} reference units, {}", options.metric,
                         study.units.size(),
                         std::string_view(kind.unit).empty() ? "a fraction" : kind.unit));
  fmt::print("\n");
  print_line(
      fmt::format(head, "unit", "reference", "runs", "bias", "se", "t", "p", "95 % interval"));
  for (const UnitBias& unit : study.units) {
    print_line(fmt::format("{:<20}{:>10.4g}{:>6}{}", unit.unit, unit.reference, unit.count,
                           format_estimate_test(unit.bias)));
  }
  const auto line = [](const char* name, const EstimateTest& estimate) {
    fmt::print("{:<36}{}\n", name, format_estimate_test(estimate));
  };
  line("all", study.overall_bias);
  if (study.linearity) {
    const Linearity& linearity = *study.linearity;
    fmt::print("\nbias = intercept + slope x reference\n");
    line("slope", linearity.slope);
    line("intercept", linearity.intercept);
    fmt::print("residual sd {:.4g}, R^2 {:.1f} %\n\n{:<20}{:>10}{:>18}   95 % band\n",
               linearity.residual_sd, 100 * linearity.r_squared, "", "reference", "line");
    for (const UnitBias& unit : study.units) {
      const double at = linearity.predict_bias_at(unit.reference),
                   half = linearity.half_width_at(unit.reference);
      print_line(fmt::format("{:<20}{:>10.4g}{:>18.4g}   {:.4g} to {:.4g}{}", unit.unit,
                             unit.reference, at, at - half, at + half,
                             std::abs(at) > half ? "   without 0" : ""));
    }
  }
  if (!options.output.empty()) write_bias_plot(options.output, options.metric, values, study);
}

/// Returns true if the filter keeps all runs of a camera, so that its first one is known.
bool includes_all_runs(const RunFilter& filter) {
  return filter.verdict.empty() && filter.operator_name.empty() && filter.shift.empty() &&
         filter.since.empty() && filter.until.empty() && filter.last == 0;
}

}  // namespace

void print_runs(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  RunFilter filter = filter_by_options(options, known);
  const auto runs = known.runs.list_run_summaries(filter);
  constexpr const char* line = "{:<34} {:<20} {:<8} {:<7} {:<12} {:<16} {}";
  print_line(
      fmt::format(line, "run", "ended (UTC)", "verdict", "kind", "station", "camera", "cause"));
  for (const RunSummary& run : runs) {
    const bool counts = run.voided.empty();
    print_line(fmt::format(line, run.run, run.ended_utc, counts ? run.verdict : "VOID", run.kind,
                           run.station, run.camera,
                           counts ? run.causes.substr(0, run.causes.find('\n'))
                                  : "was " + run.verdict + ": " + run.voided));
  }
  const RunCounts counts = count_runs(runs);
  fmt::print("\n{} runs, {} passed, {} failed, {} invalid", runs.size(), counts.passed,
             counts.failed, counts.invalid);
  if (counts.voided > 0) fmt::print(", {} voided", counts.voided);
  constexpr double percent = 100;
  if (const auto yield = counts.compute_yield()) {
    fmt::print(": yield {:.1f} % of {}", percent * *yield, counts.units_judged);
  }
  fmt::print("\n");
  if (const auto yield = counts.compute_first_pass_yield();
      yield && includes_all_runs(options.filter)) {
    fmt::print("{} cameras, {} with more than one judged run: first-pass yield {:.1f} %\n",
               counts.cameras, counts.cameras_reworked, percent * *yield);
  }
  filter.has_open_hook = true;
  const auto open = known.runs.list_run_summaries(filter);
  const auto without = std::ranges::count_if(runs, [&](const RunSummary& run) {
    return std::ranges::find(open, run.run, &RunSummary::run) != open.end();
  });
  if (without > 0) {
    fmt::print(
        "{} of them with a hook that failed or did not finish: 'vlp-station hook' runs it again\n",
        without);
  }
  known.runs.records_or_throw();  // an incomplete list is an error
}

void print_run(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  const RunRecord record = load_selected_run(known, options);
  for (const ScreenLine& line : make_verdict_screen(record)) print_line(line.text);
  fmt::print("\nmetrics without a gate\n");
  for (const CheckedMetric& metric : record.metrics) {
    if (metric.limit || !metric.value) continue;
    print_line(fmt::format("{:<28}{:>12.4g} {}", metric.name, *metric.value, metric.unit));
  }
  fmt::print("\n");
  for (const RunField& field : list_run_fields()) {
    if (field.label == nullptr || (record.*field.text).empty()) continue;
    print_line(fmt::format("{:<11}{}", field.label, record.*field.text));
  }
  fmt::print("images     {}, {} used\n", record.images.size(), record.count_used_images());
  for (const RunEvent& event : record.events) {
    const std::string who = event.author.empty() ? "" : event.author + ": ";
    print_line(fmt::format("{:<11} {} {}{}", event.kind, start_utc_of_run_id(event.event), who,
                           event.text));
  }
}

void restore_run_files(const StationRecordsOptions& options) {
  const std::filesystem::path results = require_results_folder(options);
  KnownRuns known = open_runs(options);
  const RunRecord record = load_selected_run(known, options);
  const std::string no_verdict = explain_void_verdict(record);
  if (!no_verdict.empty()) throw InputError(record.run, no_verdict);
  print_line(publish_run_files(record, {}, results, ExistingReport::replace).string());
}

void write_certificate(const StationRecordsOptions& options) {
  const std::filesystem::path results = require_results_folder(options);
  KnownRuns known = open_runs(options);
  const RunRecord record = load_selected_run(known, options);
  print_line(write_certificate(record, results).string());
}

void list_or_delete_expired(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  const StationConfig& config = *known.station;
  if (!config.retention.images_days && !config.retention.results_days) {
    throw InputError(options.station, "nothing expires; add the key 'retention'");
  }
  check_clock(config, known.runs.records_or_throw());
  const RetentionResult found = list_expired_folders(config, known.runs.records_or_throw());
  constexpr double megabyte = 1e6;
  double all_mb = 0;
  std::size_t done = 0;
  for (const ExpiredFolder& expired : found.expired) {
    const double mb = double(expired.bytes) / megabyte;
    try {
      if (options.remove) delete_expired(expired, config, known.runs);
    } catch (const InputError& error) {
      spdlog::warn("{}", escape_for_terminal(error.what()));
      continue;
    }
    ++done;
    all_mb += mb;
    print_line(fmt::format("{:>10.1f} MB  {} of {}, {} {}", mb, expired.folder.string(),
                           expired.run.ended_utc, expired.run.verdict,
                           options.remove ? "(deleted)" : ""));
  }
  for (const auto& folder : found.folders_without_record) {
    // [STATION-11] `records: left`, `names: left` | folder without a run, of other records, or with
    //   a file of the station | move that file elsewhere, repeat
    spdlog::warn("{}: belongs to no run of the records: left", folder.string());
  }
  for (const auto& folder : found.folders_in_use) {
    spdlog::warn("{}: contains a file that station.yaml names: left; move that file elsewhere",
                 folder.string());
  }
  fmt::print("{} folders, {:.1f} MB{}\n", done, all_mb,
             options.remove ? " deleted" : ": --delete deletes them");
  known.runs.deliver_waiting();
  if (done == found.expired.size()) return;
  // [FILE-1] `could not be deleted`
  throw std::runtime_error(fmt::format("{} of {} folders could not be deleted",
                                       found.expired.size() - done, found.expired.size()));
}

void void_recorded_run(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  const auto [record, problem, files_problem] = void_recorded_run(
      known.runs, known.station_config(), options.run, options.operator_name, options.reason);
  if (!problem.empty()) spdlog::error("{}", escape_for_terminal(problem));
  if (!files_problem.empty()) spdlog::warn("{}", escape_for_terminal(files_problem));
  warn_if_offline(known);
  print_line(fmt::format("{} {} {}: voided", record.run, record.camera, record.verdict));
  for (const ScreenLine& line : make_hook_lines(record)) print_line(line.text);
}

void verify_records(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  const TrailCheck found = known.runs.records_or_throw().check_trail(options.expected_digest);
  for (const std::string& problem : found.problems) print_line(problem);
  fmt::print("{} runs, {} entries in the trail\n", found.runs, found.entries);
  if (!found.last_digest.empty()) fmt::print("last digest {}\n", found.last_digest);
  if (found.problems.empty()) return;
  // [STATION-8] `records were changed` | edited database, end of the trail removed, or other
  //   records | compare with a backup
  throw GateNotMet(fmt::format(
      "the records were changed: {}{}", found.problems.front(),
      found.problems.size() == 1 ? "" : fmt::format(", and {} more", found.problems.size() - 1)));
}

void export_runs(const StationRecordsOptions& options) {
  KnownRuns known = open_runs(options);
  check_output_option(options, known);
  Records& records = known.runs.records_or_throw();
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records.list_run_summaries(filter_by_options(options, known))) {
    if (auto record = records.find_run_by_id(run.run)) runs.push_back(std::move(*record));
  }
  write_runs(options.output, runs);
  fmt::print("{} runs\n", runs.size());
}

void import_archive(const StationRecordsOptions& options) {
  auto [sessions, undated, crashed, refused] = read_reprocessed(options.archive);
  if (undated > 0) {
    // [STATION-14] `program crashed`, `neither archive.csv`, `session with a date`
    spdlog::warn("{} sessions are ignored: neither archive.csv nor their names have their date",
                 undated);
  }
  if (crashed > 0) spdlog::warn("{} sessions are ignored: their program crashed", crashed);
  if (sessions.empty() && refused.empty()) {
    throw Undetermined(options.archive + ": no session with a date");
  }
  Records records(options.records);
  Progress progress("sessions");
  std::size_t taken = 0, unread = 0;
  std::vector<std::string> other;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const RunRecord& run = sessions[i].run;
    if (const auto kept = records.find_run_by_id(run.run)) {
      if (kept->config_sha256 != run.config_sha256) other.push_back(run.run);
    } else {
      std::optional<RunRecord> read;
      try {
        read = load_archive_run(sessions[i]);
      } catch (const InputError& error) {
        refused.emplace_back(error.what());
      }
      if (read) records.store_run(*read);
      ++(read ? taken : unread);
    }
    progress.update(i + 1, sessions.size());
  }
  if (!sessions.empty()) {
    print_line(fmt::format("station {}: {} runs added, {} existed", sessions.front().run.station,
                           taken, sessions.size() - taken - unread - other.size()));
  }
  if (!refused.empty()) {
    // [STATION-14] `are not imported` | sessions without result or time, or changed; others are
    //   taken | dates in names or `archive.csv`; delete a changed session's folder; reprocess
    //   (`--rebuild-catalogue`)
    throw std::invalid_argument(fmt::format("{} sessions are not imported, the first because of {}",
                                            refused.size(), refused.front()));
  }
  if (other.empty()) return;
  throw std::invalid_argument(fmt::format(
      "{} sessions, the first {}, have another result than these records; use new records",
      other.size(), other.front()));
}

void print_metric_trend(const StationRecordsOptions& options) {
  const MetricKind kind = require_run_metric_kind(options.metric);
  KnownRuns known = open_runs(options);
  check_output_option(options, known);
  Records& records = known.runs.records_or_throw();
  RunFilter filter = filter_comparable(options, known);
  if (options.filter.verdict.empty()) filter.verdict = verdict_name(Verdict::pass);
  const auto points = records.load_metric_trend(options.metric, filter);
  check_one_station(points, options);
  constexpr std::size_t min_points = 2;
  if (points.size() < min_points) {
    throw Undetermined(
        fmt::format("{} of the runs have {}: a trend needs two", points.size(), options.metric));
  }
  const std::vector<double> values = extract_trend_values(points);
  const auto alarms = list_chart_alarms(values, options.rules);
  const ControlChart chart = make_control_chart(values);
  const auto gate = find_gate_limit(options.metric, known.station_config(), records, points);
  if (!options.output.empty())
    write_trend_plot(options.output, options.metric, points, alarms, gate);
  print_line(fmt::format("{} of {} runs, {} to {}", options.metric, points.size(),
                         points.front().ended_utc, points.back().ended_utc));
  fmt::print("mean      {:.4g} {}\nlimits    {:.4g} to {:.4g}\n", chart.mean, kind.unit,
             chart.lower, chart.upper);
  if (gate) fmt::print("gate      {} {:.4g}\n", describe_direction(kind.direction), *gate);
  for (const ChartAlarm& alarm : alarms) {
    const TrendPoint& point = points[alarm.index];
    print_line(fmt::format("{} {} {} {:.4g}  {}: {}", point.ended_utc, point.run, point.camera,
                           point.value, alarm.rule, alarm.description));
  }
  if (alarms.empty()) return;
  throw GateNotMet(fmt::format("{}: {} alarms, the last {} at {}", options.metric, alarms.size(),
                               alarms.back().rule, points[alarms.back().index].run));
}

void print_capability(const StationRecordsOptions& options) {
  std::vector<MetricKind> kinds = list_run_metrics();
  if (!options.metric.empty()) kinds = {require_run_metric_kind(options.metric)};
  KnownRuns known = open_runs(options);
  Records& records = known.runs.records_or_throw();
  const RunFilter filter = filter_comparable(options, known);
  constexpr const char* head = "{:<27}{:>5}{:>10}{:>10}{:>10}{:>10}   {:<25}{}";
  std::vector<std::string> rows;
  rows.reserve(kinds.size());
  for (const MetricKind& kind : kinds) {
    const auto points = load_metric_values(records, kind.name, filter);
    check_one_station(points, options);
    const auto gate = find_gate_limit(kind.name, known.station_config(), records, points);
    const auto found =
        compute_capability(extract_trend_values(points), make_specification_limits(kind, gate));
    if (!found) continue;
    const auto index = [](const CapabilityIndex& of) {
      return fmt::format("{:.2f} ({:.2f} to {:.2f})", of.value, of.low, of.high);
    };
    rows.push_back(fmt::format(
        head, kind.name, found->count, fmt::format("{:.4g}", found->mean),
        fmt::format("{:.3g}", found->within_sd), fmt::format("{:.3g}", found->overall_sd),
        fmt::format("{} {:.4g}",
                    kind.direction == Direction::at_least ? ">=" : "<=", gate.value_or(0)),
        index(found->cpk), index(found->ppk)));
  }
  if (rows.empty()) {
    throw Undetermined("no metric with a gate has two different values in judged runs");
  }
  print_line(fmt::format(head, "metric", "runs", "mean", "sd within", "overall", "gate",
                         "Cpk (95 %)", "Ppk (95 %)"));
  for (const std::string& row : rows) print_line(row);
}

void print_gauge_study(const StationRecordsOptions& options) {
  const MetricKind kind = require_run_metric_kind(options.metric);
  if (!options.references.empty()) return print_bias(kind, options);
  KnownRuns known = open_runs(options);
  Records& records = known.runs.records_or_throw();
  RunFilter filter = options.filter;
  if (filter.kind.empty()) filter.kind = "unit";
  const auto points = load_metric_values(records, options.metric, remove_conditions_any(filter));
  const auto values = select_study_values(points, options.units);
  const MeasurementStudy study = run_study([&] {
    check_no_shared_images(records, points, values);
    return analyze_study(values);
  });
  const auto gate = find_gate_limit(options.metric, known.station_config(), records, points);
  print_line(fmt::format("{}: {} units, {} stations, {} runs each, mean {:.4g} {}", options.metric,
                         study.units, study.stations, study.repeats, study.mean, kind.unit));
  fmt::print("\n");
  fmt::print("{:<18}{:>5}{:>14}{:>14}\n", "", "dof", "squares", "mean square");
  for (const auto& [name, line] :
       {std::pair("units", study.unit), std::pair("stations", study.station),
        std::pair("units x stations", study.interaction), std::pair("error", study.error)}) {
    fmt::print("{:<18}{:>5}{:>14.5g}{:>14.5g}\n", name, line.dof, line.sum_of_squares,
               line.mean_square());
  }
  if (study.interaction_p) {
    fmt::print("units x stations by chance with p = {:.3f}: {}\n", *study.interaction_p,
               study.pooled ? "pooled with the error" : "significant");
  }
  fmt::print("\n{:<34}{:>12}{:>14}\n", "", "sd", "% of total");
  const auto part = [&](const char* name, double sd) {
    constexpr double percent = 100;
    fmt::print("{:<34}{:>12.5g}{:>14.1f}\n", name, sd,
               study.total > 0 ? percent * sd / study.total : 0);
  };
  part("repeatability (EV)", study.repeatability);
  if (study.stations > 1) {
    part("stations (AV)", study.station_sd);
    part("units x stations (INT)", study.interaction_sd);
  }
  part("measurement, total (GRR)", study.grr);
  part("units (PV)", study.unit_sd);
  part("total (TV)", study.total);
  if (const auto categories = study.count_distinct_categories()) {
    fmt::print("distinct categories (ndc){:>21}\n", *categories);
  }
  if (const auto percent_of_tolerance =
          study.precision_to_tolerance_percent(make_specification_limits(kind, gate))) {
    fmt::print("measurement / tolerance (P/T){:>17.1f} %\n", *percent_of_tolerance);
  } else if (gate) {
    fmt::print("no P/T: the mean is not within the gate, {} {:.4g}\n",
               describe_direction(kind.direction), *gate);
  }
  if (study.stations == 1) {
    fmt::print("\nOne station: differences between stations are unknown.\n");
  }
}

}  // namespace vlp
