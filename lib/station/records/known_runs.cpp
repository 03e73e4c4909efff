// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/known_runs.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

#include "captures/printable.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/records/golden_unit_schedule.h"
#include "station/records/hook.h"
#include "station/records/publish_run.h"

namespace vlp {
namespace {

void check_void_permission(const StationConfig& station, const std::string& operator_name) {
  const auto& operators = station.void_operators;
  if (operators.empty() ||
      std::find(operators.begin(), operators.end(), operator_name) != operators.end()) {
    return;
  }
  throw std::invalid_argument(
      fmt::format("operator {} may not void runs of station {}: void_operators in station.yaml has "
                  "those who may",
                  escape_text_for_single_line(operator_name), station.station));
}

}  // namespace

KnownRuns::KnownRuns(StationConfig station) : station_(std::move(station)) {
  spool_.emplace(station_->spool, station_->records);
  spool_->deliver_waiting_runs();
  offline_reason_ = spool_->last_offline_reason();  // not waited for twice
  if (offline_reason_.empty()) open_records(station_->records);
  if (!offline_reason_.empty() && list_waiting_runs().empty()) throw_unavailable();
}

KnownRuns::KnownRuns(const std::string& records) {
  open_records(records);
  if (!offline_reason_.empty()) throw_unavailable();
}

void KnownRuns::open_records(const std::string& where) {
  try {
    if (!is_database_server_address(where) && !std::filesystem::exists(where)) {
      throw InputError(describe_database(where), "there are no records");
    }
    records_.emplace(where);
  } catch (const RecordsOffline& error) {
    offline_reason_ = error.what();
    if (spool_) spool_->suspend_database_access(error);
  } catch (const InputError& error) {
    offline_reason_ = error.what();
  }
}

void KnownRuns::throw_unavailable() {
  const bool has_notice = spool_ && !spool_->last_offline_reason().empty();
  throw RecordsUnavailable(has_notice ? spool_->make_spool_notice_for_operator() : offline_reason_,
                           offline_reason_);
}

std::vector<RunRecord> KnownRuns::list_waiting_runs() {
  return spool_ ? spool_->list_waiting_runs() : std::vector<RunRecord>();
}

Records& KnownRuns::records_or_throw() {
  if (!records_) throw_unavailable();
  return *records_;
}

std::vector<RunSummary> KnownRuns::list_run_summaries(const RunFilter& filter) {
  // First, so that a run that another program delivers at this time is in one of the two.
  const std::vector<RunRecord> waiting = this->list_waiting_runs();
  return merge_stored_and_waiting_runs(
      records_ ? records_->list_run_summaries(filter) : std::vector<RunSummary>(), waiting, filter);
}

RunRecord KnownRuns::find_run_by_id(const std::string& run) {
  for (const RunRecord& waiting : this->list_waiting_runs()) {
    if (waiting.run == run) return waiting;
  }
  auto record = records_or_throw().find_run_by_id(run);
  if (!record) throw std::invalid_argument("there is no run " + run);
  return *record;
}

RunRecord KnownRuns::find_last_run(const RunFilter& filter) {
  const auto runs = list_run_summaries(filter);
  if (runs.empty()) throw std::invalid_argument("there is no such run");
  return find_run_by_id(runs.back().run);
}

std::vector<RunRecord> KnownRuns::load_matching_runs(const RunFilter& filter) {
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records_or_throw().list_run_summaries(filter)) {
    if (auto record = records_or_throw().find_run_by_id(run.run))
      runs.push_back(std::move(*record));
  }
  return runs;
}

std::optional<double> RunCounts::compute_yield() const {
  if (units_judged == 0) return std::nullopt;
  return static_cast<double>(units_passed) / static_cast<double>(units_judged);
}

std::optional<double> RunCounts::compute_first_pass_yield() const {
  if (cameras == 0) return std::nullopt;
  return static_cast<double>(cameras_passed_first) / static_cast<double>(cameras);
}

RunCounts count_runs_by_verdict(std::span<const RunSummary> runs) {
  RunCounts counts;
  std::map<std::string, int> judged;
  for (const RunSummary& run : runs) {
    if (!run.voided.empty()) {
      ++counts.voided;
      continue;
    }
    const bool passed = run.verdict == verdict_name(Verdict::pass);
    const bool failed = run.verdict == verdict_name(Verdict::fail);
    if (passed) ++counts.passed;
    if (failed) ++counts.failed;
    if (run.verdict == verdict_name(Verdict::invalid)) ++counts.invalid;
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

/// Renames the files of a voided run at its station. Returns true if it renamed or tried to;
/// `problem` is the reason why the files keep their names.
bool rename_files(const StationConfig* own_station, const RunRecord& record, std::string& problem) {
  if (own_station == nullptr) {
    problem = fmt::format(
        "the files of run {} keep their names: use the same command with --station of {} to rename "
        "them",
        record.run, record.station);
    return false;
  }
  try {
    return rename_files_of_voided_run(record, own_station->results);
  } catch (const InputError& error) {
    problem = fmt::format("the run is voided, but its files keep their names: {}", error.what());
    return true;
  }
}

}  // namespace

VoidedRun void_recorded_run(KnownRuns& known, const std::string& run,
                            const std::string& operator_name, const std::string& reason) {
  VoidedRun result{known.find_run_by_id(run)};
  RunRecord& record = result.run;
  const std::string who = escape_text_for_single_line(operator_name);
  const StationConfig* station = known.station_config();
  if (station != nullptr && record.station != station->station) station = nullptr;
  std::optional<HookLock> lock;
  if (station != nullptr && station->hook) {
    lock.emplace(known.station_spool()->spool_folder(), record.run);
    // The result of that hook would be mistaken for that of the hook about the voiding.
    if (!lock->has_acquired_hook_lock()) {
      throw InputError(record.run, "its hook is being run: void it when that has ended");
    }
    record = known.find_run_by_id(run);  // it can have been voided before the lock was acquired
  }
  if (station != nullptr) check_void_permission(*station, operator_name);
  // Each step is done unless it was done before: a voiding by the records alone (--records) lacks
  // those of the station.
  std::string repeated;
  if (const RunEvent* event = find_voiding_event(record)) {
    repeated =
        fmt::format("run {} was voided before, by {}: {}", record.run, event->author, event->text);
  } else {
    record.events.push_back(make_run_event_now(kVoided, escape_text_for_single_line(reason), who));
  }
  const bool calls_hook = lock && find_index_of_last_event_of_kind(record, kHookRequested) <
                                      find_index_of_last_event_of_kind(record, kVoided);
  if (calls_hook) record.events.push_back(make_hook_requested_event(*station->hook, who));
  bool is_any_done = repeated.empty() || calls_hook;
  Spool* spool = known.station_spool();
  if (is_any_done)
    spool != nullptr ? spool->store_run(record) : known.records_or_throw().store_run(record);
  if (station != nullptr && record.kind == "golden") {
    is_any_done = delete_golden_unit_note_of_run(*station, record.run) || is_any_done;
  }
  is_any_done = rename_files(station, record, result.files_problem) || is_any_done;
  if (!is_any_done) throw std::invalid_argument(repeated);
  if (spool != nullptr) spool->deliver_waiting_runs();
  if (calls_hook)
    result.problem = run_hook_and_record_result(*station->hook, record, *lock, *spool);
  return result;
}

}  // namespace vlp
