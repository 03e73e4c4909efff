// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_records.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "captures/printable.h"
#include "program/app.h"
#include "program/progress.h"
#include "program/station/known_runs.h"
#include "rig/input_error.h"
#include "station/records/archive_runs.h"
#include "station/records/certificate.h"
#include "station/records/publish_run.h"
#include "station/records/retention.h"
#include "station/records/run_record.h"
#include "station/records/void_run.h"
#include "station/statistics/run_metrics.h"
#include "station/unit/station_screen.h"

namespace vlp {
namespace {

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

/// Returns the folder for the files of a run.
std::filesystem::path require_results_folder(const StationRecordsOptions& options) {
  if (!options.output.empty()) return options.output;
  if (!options.station.empty()) return read_station_config(options.station).results;
  throw std::invalid_argument("the output folder is not specified; give --station or --output");
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

}  // namespace vlp
