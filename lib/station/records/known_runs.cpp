// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/known_runs.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "captures/printable.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/records/golden_unit_schedule.h"
#include "station/records/hook.h"
#include "station/records/publish_run.h"
#include "station/records/run_hooks.h"

namespace vlp {
namespace {

bool matches_filter(const RunRecord& run, const RunFilter& filter) {
  const auto is = [](const std::string& text, const std::string& wanted) {
    return wanted.empty() || text == wanted;
  };
  return is(run.camera, filter.camera) && is(run.station, filter.station) &&
         is(run.verdict, filter.verdict) && is(run.kind, filter.kind) &&
         is(run.operator_name, filter.operator_name) && is(run.shift, filter.shift) &&
         run.ended_utc >= filter.since && (filter.until.empty() || run.ended_utc < filter.until);
}

void check_void_permission(const StationConfig& station, const std::string& operator_name) {
  const auto& operators = station.void_operators;
  if (operators.empty() ||
      std::find(operators.begin(), operators.end(), operator_name) != operators.end()) {
    return;
  }
  throw std::invalid_argument(
      fmt::format("operator {} may not void runs of station {}: void_operators in station.yaml has "
                  "those who may",
                  printable_line(operator_name), station.station));
}

}  // namespace

KnownRuns::KnownRuns(StationConfig station) : station_(std::move(station)) {
  spool_.emplace(station_->spool, station_->records);
  spool_->deliver();
  offline_reason_ = spool_->last_offline_reason();  // not waited for twice
  if (offline_reason_.empty()) open(station_->records);
  if (!offline_reason_.empty() && waiting().empty()) throw_unavailable();
}

KnownRuns::KnownRuns(const std::string& records) {
  open(records);
  if (!offline_reason_.empty()) throw_unavailable();
}

void KnownRuns::open(const std::string& where) {
  try {
    if (!is_server_address(where) && !std::filesystem::exists(where)) {
      throw InputError(describe_database(where), "there are no records");
    }
    records_.emplace(where);
  } catch (const RecordsOffline& error) {
    offline_reason_ = error.what();
    if (spool_) spool_->suspend_access(error);
  } catch (const InputError& error) {
    offline_reason_ = error.what();
  }
}

void KnownRuns::throw_unavailable() {
  const bool has_notice = spool_ && !spool_->last_offline_reason().empty();
  throw RecordsUnavailable(has_notice ? spool_->notice() : offline_reason_, offline_reason_);
}

std::vector<RunRecord> KnownRuns::waiting() {
  return spool_ ? spool_->waiting() : std::vector<RunRecord>();
}

Records& KnownRuns::records() {
  if (!records_) throw_unavailable();
  return *records_;
}

std::vector<RunSummary> KnownRuns::list(const RunFilter& filter) {
  std::vector<RunSummary> runs;
  // First, so that a run that another program delivers at this time is in one of the two.
  const std::vector<RunRecord> waiting = this->waiting();
  if (records_) runs = records_->list(filter);
  for (const RunRecord& run : waiting) {
    const RunEvent* event = voided(run);
    const auto existing = std::find_if(
        runs.begin(), runs.end(), [&](const RunSummary& other) { return other.run == run.run; });
    if (existing != runs.end() && event != nullptr) existing->voided = event->text;
    if (existing != runs.end() || !matches_filter(run, filter)) continue;
    runs.push_back({run.run, run.kind, run.station, run.camera, run.ended_utc, run.verdict,
                    "(waits here) " + run.causes, event == nullptr ? "" : event->text});
  }
  std::stable_sort(runs.begin(), runs.end(), [](const RunSummary& a, const RunSummary& b) {
    return std::tie(a.ended_utc, a.run) < std::tie(b.ended_utc, b.run);
  });
  return keep_last(std::move(runs), filter.last);
}

RunRecord KnownRuns::find(const std::string& run) {
  for (const RunRecord& waiting : this->waiting()) {
    if (waiting.run == run) return waiting;
  }
  auto record = records().find(run);
  if (!record) throw std::invalid_argument("there is no run " + run);
  return *record;
}

RunRecord KnownRuns::last(const RunFilter& filter) {
  const auto runs = list(filter);
  if (runs.empty()) throw std::invalid_argument("there is no such run");
  return find(runs.back().run);
}

std::vector<RunRecord> KnownRuns::load_all(const RunFilter& filter) {
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records().list(filter)) {
    if (auto record = records().find(run.run)) runs.push_back(std::move(*record));
  }
  return runs;
}

std::vector<std::string> KnownRuns::find_open_hooks() {
  if (spool_) return spool_->find_open_hooks(station_->station);
  return records().find_open_hooks("");
}

std::optional<double> RunCounts::yield() const {
  if (units_judged == 0) return std::nullopt;
  return static_cast<double>(units_passed) / static_cast<double>(units_judged);
}

std::optional<double> RunCounts::first_pass_yield() const {
  if (cameras == 0) return std::nullopt;
  return static_cast<double>(cameras_passed_first) / static_cast<double>(cameras);
}

RunCounts count_runs(std::span<const RunSummary> runs) {
  RunCounts counts;
  std::map<std::string, int> judged;
  for (const RunSummary& run : runs) {
    if (!run.voided.empty()) {
      ++counts.voided;
      continue;
    }
    const bool passed = run.verdict == to_string(Verdict::pass);
    const bool failed = run.verdict == to_string(Verdict::fail);
    if (passed) ++counts.passed;
    if (failed) ++counts.failed;
    if (run.verdict == to_string(Verdict::invalid)) ++counts.invalid;
    if (run.kind != "unit") continue;
    if (passed) ++counts.units_passed;
    if (!passed && !failed) continue;
    ++counts.units_judged;
    if (const auto runs_of_camera = ++judged[run.camera]; runs_of_camera == 1) {
      ++counts.cameras;
      if (passed) ++counts.cameras_passed_first;
    } else if (runs_of_camera == 2) {
      ++counts.cameras_reworked;
    }
  }
  return counts;
}

namespace {

/// Renames the files of a voided run. Returns the reason why they were not renamed; empty if they
/// were.
std::string rename_files(const StationConfig* own_station, const RunRecord& record) {
  if (own_station == nullptr) {
    return fmt::format(
        "the files of run {} keep their names: the same command with --station of {}"
        " renames them",
        record.run, record.station);
  }
  try {
    mark_files_voided(record, own_station->results);
    return "";
  } catch (const InputError& error) {
    return fmt::format("the run is voided, but its files keep their names: {}", error.what());
  }
}

/// Returns true if a hook was called since a run was voided.
bool is_hook_informed(const RunRecord& record) {
  const auto begin = std::find_if(record.events.begin(), record.events.end(),
                                  [](const RunEvent& event) { return event.what == kVoided; });
  return std::any_of(begin, record.events.end(),
                     [](const RunEvent& event) { return event.what == kHookRequested; });
}

/// Completes at the station of a run a voiding by the records alone (--records): golden unit, files
/// and hook. Returns false if no step was missing.
bool complete_voiding(KnownRuns& known, RunRecord& record, const std::string& who,
                      const std::optional<HookLock>& lock, VoidedRun& result) {
  const StationConfig& station = *known.station();
  bool is_any_done = record.kind == "golden" && invalidate_golden_note(station, record.run);
  try {
    is_any_done = mark_files_voided(record, station.results) || is_any_done;
  } catch (const InputError& error) {
    result.files_problem =
        fmt::format("the run is voided, but its files keep their names: {}", error.what());
    is_any_done = true;
  }
  if (!lock || is_hook_informed(record)) return is_any_done;
  Spool& spool = *known.spool();
  record.events.push_back(make_hook_requested_event(*station.hook, who));
  spool.keep(record);
  spool.deliver();
  result.problem = call_hook(*station.hook, record, *lock, spool);
  return true;
}

}  // namespace

VoidedRun void_run(KnownRuns& known, const std::string& run, const std::string& operator_name,
                   const std::string& reason) {
  VoidedRun result{known.find(run)};
  RunRecord& record = result.run;
  const std::string who = printable_line(operator_name);
  const auto& station = known.station();
  const bool is_own_station = station && record.station == station->station;
  std::optional<HookLock> lock;
  if (is_own_station && station->hook) {
    lock.emplace(known.spool()->folder(), record.run);
    // The result of that hook would be mistaken for that of the hook about the voiding.
    if (!lock->held()) {
      throw InputError(record.run, "its hook is being run: void it when that has ended");
    }
    record = known.find(run);  // it can have been voided before the lock was acquired
  }
  const StationConfig* own_station = is_own_station ? &*station : nullptr;
  if (is_own_station) check_void_permission(*station, operator_name);
  if (const RunEvent* event = voided(record)) {
    if (is_own_station && complete_voiding(known, record, who, lock, result)) return result;
    throw std::invalid_argument(
        fmt::format("run {} was voided before, by {}: {}", record.run, event->who, event->text));
  }
  record.events.push_back(make_event(kVoided, printable_line(reason), who));
  if (!station) {
    known.records().keep(record);
    result.files_problem = rename_files(own_station, record);
    return result;
  }
  Spool& spool = *known.spool();
  if (lock) record.events.push_back(make_hook_requested_event(*station->hook, who));
  spool.keep(record);
  if (is_own_station && record.kind == "golden") invalidate_golden_note(*station, record.run);
  result.files_problem = rename_files(own_station, record);
  spool.deliver();
  if (lock) result.problem = call_hook(*station->hook, record, *lock, spool);
  return result;
}

}  // namespace vlp
