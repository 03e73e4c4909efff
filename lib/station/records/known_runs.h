// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "station/records/records.h"
#include "station/records/spool.h"
#include "station/station_config.h"

namespace vlp {

/// Error if records are offline that a command needs. what() is for the operator, `details` has the
/// reason.
class RecordsUnavailable : public std::runtime_error {
 public:
  RecordsUnavailable(const std::string& notice, std::string why)
      : std::runtime_error(notice), details(std::move(why)) {}
  std::string details;
};

/// All runs that are known: those of the records (database) and, for a station, those that wait in
/// its spool. The constructor for a station first delivers waiting runs to the records.
class KnownRuns {
 public:
  /// Opens the runs of a station. Throws RecordsUnavailable if its records are offline and no run
  /// waits.
  explicit KnownRuns(StationConfig station);
  /// Opens the runs of records without a station (Records). Throws RecordsUnavailable if they are
  /// offline, or if the file does not exist: no records are created.
  explicit KnownRuns(const std::string& records);

  /// Returns the station; null for records without a station.
  const StationConfig* station_config() const { return station_ ? &*station_ : nullptr; }
  /// Returns the station's spool; null without a station.
  Spool* station_spool() { return spool_ ? &*spool_ : nullptr; }
  /// Returns the records. Throws RecordsUnavailable if they are offline.
  Records& records_or_throw();
  /// Returns true if the records are offline. Only the waiting runs are known then.
  bool are_records_offline() const { return !records_; }

  /// Returns the runs of the records, if online, and the waiting runs
  /// (merge_stored_and_waiting_runs()).
  std::vector<RunSummary> list_run_summaries(const RunFilter& filter);
  /// Returns a run that waits or that the records contain. Throws std::invalid_argument if no run
  /// has this id, otherwise as records_or_throw().
  RunRecord find_run_by_id(const std::string& run);
  /// Returns the last run that matches the filter. Throws as find_run_by_id().
  RunRecord find_last_run(const RunFilter& filter);
  /// Returns the complete runs that the records contain.
  std::vector<RunRecord> load_matching_runs(const RunFilter& filter);

 private:
  void open_records(const std::string& where);
  [[noreturn]] void throw_unavailable();
  std::vector<RunRecord> list_waiting_runs();

  std::optional<StationConfig> station_ = {};
  std::optional<Spool> spool_ = {};
  std::optional<Records> records_ = {};
  /// Reason why the records are offline.
  std::string offline_reason_ = {};
};

/// Numbers of runs by result; voided runs are counted separately.
struct RunCounts {
  std::size_t passed = 0, failed = 0, invalid = 0, voided = 0;
  /// Number of judged runs of units that passed, and number of all judged runs of units.
  std::size_t units_passed = 0, units_judged = 0;
  /// Cameras with judged runs as units: all, those whose first run passed, and those with two runs
  /// or more.
  std::size_t cameras = 0, cameras_passed_first = 0, cameras_reworked = 0;

  /// Returns the fraction of runs of units that passed, std::nullopt if no unit was judged.
  std::optional<double> compute_yield() const;
  /// Returns the fraction of cameras whose first run passed, std::nullopt if no unit was judged.
  std::optional<double> compute_first_pass_yield() const;
};

/// Counts runs. `runs` are in chronological order.
RunCounts count_runs_by_verdict(std::span<const RunSummary> runs);

struct VoidedRun {
  RunRecord run;
  /// Reason why the result of the hook is not recorded; empty if it is.
  std::string problem = {};
  /// Reason why the files of the run were not renamed; empty if they were.
  std::string files_problem = {};
};
/// Voids a run, which then counts in no yield, trend or study. Its events record operator and
/// reason. A voided golden run makes the golden unit due.
///
/// At the station of the run its files are renamed (rename_files_of_voided_run()), and its hook is
/// called (run_hook_and_record_result()). These steps are completed there for a run that was voided
/// before with records alone.
///
/// Throws std::invalid_argument if the operator is not among StationConfig::void_operators of that
/// station. Throws it, too, if the run was voided before and no step is missing. Throws InputError
/// if the event cannot be recorded or the hook is running.
VoidedRun void_recorded_run(KnownRuns& known, const std::string& run,
                            const std::string& operator_name, const std::string& reason);

}  // namespace vlp
