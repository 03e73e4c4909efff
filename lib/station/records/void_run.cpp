// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/void_run.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "captures/printable.h"
#include "rig/input_error.h"
#include "station/records/golden_unit_schedule.h"
#include "station/records/hook.h"
#include "station/records/publish_run.h"

namespace vlp {
namespace {

void check_permission(const StationConfig& station, const std::string& operator_name) {
  const auto& operators = station.void_operators;
  if (operators.empty() ||
      std::find(operators.begin(), operators.end(), operator_name) != operators.end()) {
    return;
  }
  throw std::invalid_argument(
      fmt::format("operator {} may not void runs of station {}: void_operators in station.yaml has "
                  "those who may",
                  escape_for_line(operator_name), station.station));
}

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
    return rename_voided_files(record, own_station->results);
  } catch (const InputError& error) {
    problem = fmt::format("the run is voided, but its files keep their names: {}", error.what());
    return true;
  }
}

}  // namespace

VoidedRun void_recorded_run(Spool& runs, const StationConfig* station, const std::string& run,
                            const std::string& operator_name, const std::string& reason) {
  VoidedRun result{runs.require_run(run)};
  RunRecord& record = result.run;
  const std::string who = escape_for_line(operator_name);
  if (station != nullptr && record.station != station->station) station = nullptr;
  std::optional<HookLock> lock;
  if (station != nullptr && station->hook) {
    lock.emplace(runs.spool_folder(), record.run);
    // The result of that hook would be mistaken for that of the hook about the voiding.
    if (!lock->is_holding()) {
      throw InputError(record.run, "its hook is being run: void it when that has ended");
    }
    record = runs.require_run(run);  // it can have been voided before the lock was acquired
  }
  if (station != nullptr) check_permission(*station, operator_name);
  // Each step is done unless it was done before: a voiding by the records alone (--records) lacks
  // those of the station.
  std::string repeated;
  if (const RunEvent* event = find_voiding_event(record)) {
    repeated =
        fmt::format("run {} was voided before, by {}: {}", record.run, event->author, event->text);
  } else {
    record.events.push_back(make_run_event_now(kVoided, escape_for_line(reason), who));
  }
  const bool calls_hook =
      lock && get_last_event_index(record, kHookRequested) < get_last_event_index(record, kVoided);
  if (calls_hook) record.events.push_back(make_requested_event(*station->hook, who));
  bool is_any_done = repeated.empty() || calls_hook;
  if (is_any_done) runs.store_run(record);
  if (station != nullptr && record.kind == "golden") {
    is_any_done = delete_golden_note(*station, record.run) || is_any_done;
  }
  is_any_done = rename_files(station, record, result.files_problem) || is_any_done;
  if (!is_any_done) throw std::invalid_argument(repeated);
  runs.deliver_waiting();
  if (calls_hook) result.problem = run_and_record_hook(*station->hook, record, *lock, runs);
  return result;
}

}  // namespace vlp
