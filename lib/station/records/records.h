// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/input_error.h"
#include "station/records/run_record.h"
#include "station/records/trail.h"

namespace vlp {

/// Which runs; what is empty is not asked for.
struct RunFilter {
  std::string camera, station, verdict, kind;
  /// Operator and shift of the run.
  std::string operator_name = {}, shift = {};
  /// Those that ended at this UTC or later, and before that one, as 2026-11-21 or 2026-11-21T13:45.
  std::string since = {}, until = {};
  /// The last ones; 0 for all.
  int last = 0;
};

/// What is wrong with such a UTC, 2026-11-21T13:45:01Z or its beginning from the day on; empty when
/// nothing is.
std::string utc_problem(const std::string& text);

/// A run as it is listed.
struct RunSummary {
  std::string run, kind, station, camera, ended_utc, verdict, causes;
  /// Why it was voided; empty when it was not.
  std::string voided = {};
};

/// A figure of one run.
struct TrendPoint {
  std::string run, station, camera, verdict, ended_utc;
  double value;
};

std::vector<double> values_of(std::span<const TrendPoint> points);

/// The last so many of what is in order; all of it for 0.
template <typename Row>
std::vector<Row> last_of(std::vector<Row> rows, int last) {
  const auto kept = static_cast<std::size_t>(last);
  if (last > 0 && rows.size() > kept) {
    rows.erase(rows.begin(), rows.end() - static_cast<std::ptrdiff_t>(kept));
  }
  return rows;
}

/// Records that give no answer, refuse the connection or their user, or are locked: a later try may
/// do.
class RecordsAway : public InputError {
 public:
  using InputError::InputError;
};
/// Records that answer but refuse access: somebody has to mend `records` or the server.
class RecordsRefused : public RecordsAway {
 public:
  using RecordsAway::RecordsAway;
};

/// The records of one or more stations in a database: a file of SQLite, or PostgreSQL by a
/// connection string postgresql://... Tables are made when they are not there, those of an earlier
/// version brought up to date; of a later one they are refused. Any number of programs may use it
/// at once: each run is written in one transaction, which waits for another's, with its entries in
/// the trail (trail.h). What is kept is on
/// the disk. A connection that was lost is made again. All throw InputError that names the
/// database, but no password; it is RecordsAway when the server cannot be reached, or answers but
/// refuses the connection (a wrong password, no such database, no TLS), which it says, the file
/// cannot be opened, another program holds a lock, or no answer came for patience_s(), ten times as
/// long where many runs are asked for, 360 times where tables are made or brought up to date.
class Records {
 public:
  explicit Records(const std::string& where);
  ~Records();
  Records(const Records&) = delete;
  Records& operator=(const Records&) = delete;

  /// Keeps a run, whole or not at all. One that is kept already stays as it is, but gets the events
  /// that it does not have; another of its name is refused.
  void keep(const RunRecord& record);
  /// All of one run; nothing when it is not kept.
  std::optional<RunRecord> find(const std::string& run);
  /// Throws InputError when no run could be kept now.
  void check_writable();
  /// Returns the first run of another camera, not voided, that uses an image of
  /// this digest; an empty string if there is none.
  ImageOwner owner_of(const std::string& sha256, const std::string& other_than_camera);
  /// Returns the judged runs of a unit, not voided, that use an image of this digest, the earliest
  /// first.
  std::vector<std::string> judged_runs_with(const std::string& sha256, const std::string& camera);
  /// The first judged run of a golden unit that uses an image of this digest; empty when there is
  /// none.
  std::string golden_run_of(const std::string& sha256);
  /// The runs of this station, or of all when it is empty, whose hook is open (hook_is_open()),
  /// from the first to the last.
  std::vector<std::string> with_open_hook(const std::string& station);
  /// From the first to the last.
  std::vector<RunSummary> list(const RunFilter& filter);
  /// Without runs that were voided.
  std::vector<TrendPoint> trend(const std::string& figure, const RunFilter& filter);
  /// Whether all that is kept is as it was kept, by the trail (trail.h). `noted`: the last digest
  /// of an earlier check, which the trail has to have still, or empty.
  TrailCheck check(const std::string& noted);

 private:
  struct Database;
  std::unique_ptr<Database> database_;
};

}  // namespace vlp
