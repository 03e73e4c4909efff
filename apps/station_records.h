// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/records.h"

namespace vlp {

/// Where records are, and which.
struct StationRecordsOptions {
  /// station.yaml, or a database: one of the two.
  std::string station, records;
  RunFilter filter;
  std::string run, figure, output;
};

/// vlp-station list: a line for each run.
void list_runs(const StationRecordsOptions& options);
/// vlp-station show: all of one run, the last of a camera unless it is named.
void show_run(const StationRecordsOptions& options);
/// vlp-station restore: the files of a run, written from its record where they are missing.
void restore_run(const StationRecordsOptions& options);
/// vlp-station export: CSV, a line for each run, or JSON with all there is.
void export_runs(const StationRecordsOptions& options);
/// vlp-station trend: a figure over the runs, as a picture with a control chart's limits; of units
/// of the station that passed, unless the filter says otherwise. Throws GateNotMet for an alarm.
void show_trend(const StationRecordsOptions& options);

}  // namespace vlp
