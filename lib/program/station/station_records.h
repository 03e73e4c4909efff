// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/records/records.h"

namespace vlp {

/// Options of the commands on records.
struct StationRecordsOptions {
  /// Location of the records: file station.yaml, or the database itself (SQLite file or
  /// postgresql:// address). Exactly one of the two is not empty.
  std::string station, records;
  RunFilter filter;
  std::string run, metric, output;
  /// void: name of the operator, and the reason.
  std::string operator_name, reason;
  /// verify-records: last digest of an earlier check; may be empty.
  std::string expected_digest;
  /// import: results of reprocessing.
  std::string archive;
  /// clean: deletes expired folders; otherwise only lists them.
  bool remove = false;
  /// trend: rules of the control chart.
  std::vector<std::string> rules{"western-electric"};
  /// trend: number of last runs whose alarms count; default: the longest Western Electric pattern.
  std::size_t window = 8;
  /// study: ids of the units; empty: all units with at least two runs.
  std::vector<std::string> units;
  /// study: reference units as UNIT=VALUE, for bias and linearity.
  std::vector<std::string> references;
};

/// Prints a line for each run (vlp-station list).
void print_runs(const StationRecordsOptions& options);
/// Prints all data of a run: the named one, or the last that the filter accepts (vlp-station show).
void print_run(const StationRecordsOptions& options);
/// Writes the missing files of a run from its record (vlp-station restore). Replaces the report and
/// keeps the old one as replaced-report.html.
void restore_run_files(const StationRecordsOptions& options);
/// Writes a certificate for the recipient of the unit next to the files of its run (vlp-station
/// certificate).
void write_certificate(const StationRecordsOptions& options);
/// Lists the folders of runs whose retention time has expired, or deletes them and adds an event to
/// each run (vlp-station clean). Records are kept.
void list_or_delete_expired(const StationRecordsOptions& options);
/// Voids a run (vlp-station void): yield, trends and studies ignore it. Adds an event to the run.
void void_recorded_run(const StationRecordsOptions& options);
/// Verifies by the audit trail that all records are unchanged (vlp-station verify-records). Throws
/// GateNotMet if one was changed.
void verify_records(const StationRecordsOptions& options);
/// Exports runs as CSV, a line per run, or as JSON with all data (vlp-station export).
void export_runs(const StationRecordsOptions& options);
/// Imports the reprocessed sessions of an archive as runs of a station with the name of the results
/// (vlp-station import). Existing runs are kept unchanged.
void import_archive(const StationRecordsOptions& options);
/// Prints a metric over the runs, with limits and alarms of a control chart, and optionally draws a
/// plot (vlp-station trend). Default of the filter: units of the station that passed. Throws
/// GateNotMet if there is an alarm in the last `window` runs.
void print_metric_trend(const StationRecordsOptions& options);
/// Prints the capability indices Cpk and Ppk of the metrics that have gates (vlp-station
/// capability).
void print_capability(const StationRecordsOptions& options);
/// Prints a gauge study of a metric (vlp-station study): contribution of the measurement to its
/// variation, from units measured several times on each station, or bias and linearity, from
/// reference units.
void print_gauge_study(const StationRecordsOptions& options);

}  // namespace vlp
