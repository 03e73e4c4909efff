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
/// vlp-station export: CSV, a line for each run, or JSON with all there is.
void export_runs(const StationRecordsOptions& options);
/// vlp-station trend: a figure over the runs, as a picture with a control chart's limits.
void show_trend(const StationRecordsOptions& options);

}  // namespace vlp
