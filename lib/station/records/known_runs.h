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

/// Records that a command needs are away. what() is for the operator; `details` has the reason.
class RecordsUnavailable : public std::runtime_error {
 public:
  RecordsUnavailable(const std::string& notice, std::string why)
      : std::runtime_error(notice), details(std::move(why)) {}
  std::string details;
};

/// What is known of runs: records, and of a station also what waits for them in its spool, which is
/// brought there first.
class KnownRuns {
 public:
  /// Reads the runs of a station. Throws RecordsUnavailable if its records are away and nothing
  /// waits.
  explicit KnownRuns(StationConfig station);
  /// Reads the runs of records alone (Records). Throws RecordsUnavailable if they are away, and for
  /// a file that is not there: no records are made.
  explicit KnownRuns(const std::string& records);

  const std::optional<StationConfig>& station() const { return station_; }
  /// Null without a station.
  Spool* spool() { return spool_ ? &*spool_ : nullptr; }
  /// For what cannot do without them: throws RecordsUnavailable when they are away.
  Records& records();
  /// Returns true if the records cannot be asked: what is known are the runs that wait.
  bool are_away() const { return !records_; }

  /// Of the records, if they answer, and of those that wait, whose causes say so; from the first to
  /// the last.
  std::vector<RunSummary> list(const RunFilter& filter);
  /// A run that waits, or that the records have. Throws std::invalid_argument without one, and as
  /// records().
  RunRecord find(const std::string& run);
  /// The last run that the filter lets through; throws as find().
  RunRecord last(const RunFilter& filter);
  /// All of the runs that the records have.
  std::vector<RunRecord> whole(const RunFilter& filter);
  /// By name, of the station, whose hooks 'vlp-station hook' runs: those with a hook that has not
  /// ended well.
  std::vector<std::string> with_open_hook();

 private:
  void open(const std::string& where);
  [[noreturn]] void throw_unavailable();
  std::vector<RunRecord> waiting();

  std::optional<StationConfig> station_ = {};
  std::optional<Spool> spool_ = {};
  std::optional<Records> records_ = {};
  /// Why the records cannot be asked.
  std::string away_ = {};
};

/// How runs ended, those that were voided apart.
struct RunCounts {
  std::size_t passed = 0, failed = 0, invalid = 0, voided = 0;
  /// Of the units that were judged, those that passed.
  std::size_t units_passed = 0, units_judged = 0;
  /// Cameras that were judged as units: all, those whose first run passed, and those with two runs
  /// or more.
  std::size_t cameras = 0, cameras_passed_first = 0, cameras_reworked = 0;

  /// Returns the fraction of runs of units that passed, std::nullopt if no unit was judged.
  std::optional<double> yield() const;
  /// Returns the fraction of cameras whose first run passed, std::nullopt if no unit was judged.
  std::optional<double> first_pass_yield() const;
};

/// Counts runs, given from the first to the last.
RunCounts count_runs(std::span<const RunSummary> runs);

struct Voided {
  RunRecord run;
  /// Why it is not recorded what became of the hook; empty when it is.
  std::string problem = {};
  /// Reason for which the files of the run keep their names; empty if they do not.
  std::string files_problem = {};
};
/// Voids a run: it counts no more, in no yield, trend or study, which its events tell, with who and
/// why, and a golden run makes the golden unit due. At the station whose run it is, its files are
/// renamed (mark_files_voided()), and its hook is told (call_hook()). A run that was voided before
/// with its records alone gets there what is missing. Throws std::invalid_argument for an operator
/// who is not among StationConfig::void_operators of that station, and for a run that was voided
/// before if nothing is missing, InputError when it cannot be kept or its hook is being run.
Voided void_run(KnownRuns& known, const std::string& run, const std::string& operator_name,
                const std::string& reason);

}  // namespace vlp
