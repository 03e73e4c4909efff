// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "station/records/audit_trail.h"
#include "station/records/record_errors.h"
#include "station/records/run_record.h"

namespace vlp {

/// Selection of runs. Empty members do not restrict it.
struct RunFilter {
  std::string camera = {}, station = {}, verdict = {}, kind = {};
  /// Exact names of the operator and of the shift of a selected run; empty: any.
  std::string operator_name = {}, shift = {};
  /// End of the run: at or after `since`, and before `until`, UTC, as 2026-11-21 or
  /// 2026-11-21T13:45.
  std::string since = {}, until = {};
  /// SHA-256 of an image that a selected run uses.
  std::string image_sha256 = {};
  /// Identity of the records to which a waiting run belongs (Records::store_run()).
  std::string destination = {};
  /// True for runs with an open hook only (is_hook_pending()).
  bool has_open_hook = false;
  /// Maximum number of runs, the latest ones; 0 for all.
  int last = 0;
};

/// Texts of a run for a list of runs.
struct RunSummary {
  std::string run, kind, station, camera, ended_utc, verdict, causes;
  /// Reason for voiding it; empty if it is not voided.
  std::string voided = {};
  /// RunFilter::destination; empty in the records themselves.
  std::string destination = {};
};

/// Value of a metric in one run, in the unit of the metric.
struct TrendPoint {
  std::string run, station, camera, verdict, ended_utc;
  double value;
};

std::vector<double> extract_trend_values(std::span<const TrendPoint> points);

/// Returns the last `last` elements of `rows`; all of them if `last` is 0.
template <typename Row>
std::vector<Row> keep_last_rows(std::vector<Row> rows, int last) {
  const auto kept = static_cast<std::size_t>(last);
  if (last > 0 && rows.size() > kept) {
    rows.erase(rows.begin(), rows.end() - static_cast<std::ptrdiff_t>(kept));
  }
  return rows;
}

class RecordDatabase;

/// Records of one or more stations in a database: an SQLite file, or PostgreSQL by a connection
/// string postgresql://...
///
/// Missing tables are created; tables of another version are an error.
/// Any number of programs may use a database at the same time. Each run is written in one
/// transaction, together with its entries in the trail (audit_trail.h). A transaction waits for
/// those of other programs. Committed data is on the disk. A lost connection is opened again.
///
/// All functions throw InputError that names the database, without passwords. The error is
/// RecordsOffline if
/// - the server cannot be reached,
/// - the server refuses the connection (wrong password, no such database, no TLS), which the
///   message states,
/// - the file cannot be opened,
/// - another program holds a lock, or
/// - the time limit expired: get_timeout_s(), 10 times that for queries of many runs
///   (without RunFilter::image_sha256).
class Records {
 public:
  explicit Records(const std::string& where);
  ~Records();
  Records(const Records&) = delete;
  Records& operator=(const Records&) = delete;

  /// Stores a run atomically. A stored run is not changed but gets the events that it lacks. A
  /// different run of the same id is an error.
  /// @param destination  identity of other records, to which the run is to be delivered; else empty
  void store_run(const RunRecord& record, const std::string& destination = "");
  /// Removes a delivered run with its trail, unless an event was added since it was read.
  void remove_delivered(const RunRecord& record);
  /// Returns a complete run; std::nullopt if no run has this id.
  std::optional<RunRecord> find_run_by_id(const std::string& run);
  /// Checks that runs can be stored now. Throws InputError otherwise.
  void check_writable();
  /// Returns the runs that match the filter, in chronological order.
  std::vector<RunSummary> list_run_summaries(const RunFilter& filter);
  /// Returns the values of a metric in the runs that match the filter, without voided runs.
  std::vector<TrendPoint> load_metric_trend(const std::string& metric, const RunFilter& filter);
  /// Checks by the trail (audit_trail.h) that the records are unchanged. `expected_digest` is the
  /// last digest of an earlier check, which the trail must still contain, or empty.
  TrailCheck check_trail(const std::string& expected_digest);

 private:
  std::unique_ptr<RecordDatabase> database_;
};

}  // namespace vlp
