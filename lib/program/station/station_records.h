// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/records/records.h"

namespace vlp {

/// Where records are, and which.
struct StationRecordsOptions {
  /// station.yaml, or a database: one of the two.
  std::string station, records;
  RunFilter filter;
  std::string run, figure, output;
  /// Of void: who, and why.
  std::string operator_name, reason;
  /// Of verify-records: the last digest of an earlier one; may be empty.
  std::string noted;
  /// Of import: results of reprocessing.
  std::string archive;
  /// Of clean: delete, instead of telling what would be.
  bool remove = false;
  /// Of a control chart.
  std::vector<std::string> rules{"western-electric"};
  /// Of a study: its units; those with two runs or more when there is none.
  std::vector<std::string> units;
  /// Or its reference units, as UNIT=VALUE.
  std::vector<std::string> references;
};

/// vlp-station list: a line for each run.
void list_runs(const StationRecordsOptions& options);
/// vlp-station show: all of one run, the last of a camera unless it is named.
void show_run(const StationRecordsOptions& options);
/// vlp-station restore: the files of a run, written from its record where they are missing.
void restore_run(const StationRecordsOptions& options);
/// vlp-station certificate: a page for who gets the unit, beside the files of its run.
void write_certificate(const StationRecordsOptions& options);
/// vlp-station clean: what of the station's runs is kept no longer, deleted when that is asked for,
/// which the runs' events tell. Records stay.
void clean_up(const StationRecordsOptions& options);
/// vlp-station void: a run counts no more, in no yield, trend or study, which its events tell.
void void_run(const StationRecordsOptions& options);
/// vlp-station verify-records: whether all records are as they were kept, by their trail. Throws
/// GateNotMet when they are not.
void verify_records(const StationRecordsOptions& options);
/// vlp-station export: CSV, a line for each run, or JSON with all there is.
void export_runs(const StationRecordsOptions& options);
/// vlp-station import: the sessions of an archive, as reprocessing left them, as runs of a station
/// that has the results' name. Those that are there already stay.
void import_archive(const StationRecordsOptions& options);
/// vlp-station trend: a figure over the runs, with a control chart's limits and rules, also as a
/// picture; of units of the station that passed, unless the filter says otherwise. Throws
/// GateNotMet for an alarm.
void show_trend(const StationRecordsOptions& options);
/// vlp-station capability: how the figures that have gates scatter, compared with them.
void show_capability(const StationRecordsOptions& options);
/// vlp-station study: what measuring adds to a figure, of units that were measured several times on
/// each of the stations; of reference units, bias and linearity.
void show_study(const StationRecordsOptions& options);

}  // namespace vlp
