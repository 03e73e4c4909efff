// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "program/station/station_records.h"
#include "station/records/spool.h"
#include "station/station_config.h"

namespace vlp {

/// Prints a line to stdout. Escapes control characters, so that names in records can neither add a
/// line nor control the terminal.
void print_line(const std::string& text);

/// Runs on which a command of vlp-station works: those of a station with its spool, or those of a
/// database of records without a station (`station` is then std::nullopt).
struct KnownRuns {
  std::optional<StationConfig> station;
  Spool runs;

  /// Returns the station; null for records alone.
  const StationConfig* station_config() const { return station ? &*station : nullptr; }
};

/// Opens the runs of a station or of records alone. Delivers waiting runs first, and reports the
/// state of the spool. If the records are unavailable, commands that continue with
/// waiting runs report it (warn_if_offline()).
KnownRuns open_runs(const StationRecordsOptions& options);

/// Reports that a command used the waiting runs because the records are unavailable.
void warn_if_offline(KnownRuns& known);

/// Removes the conditions that are "any".
RunFilter remove_any_conditions(RunFilter filter);

/// Returns the filter of the options: runs of --station, unless --of-station is given.
RunFilter filter_by_options(const StationRecordsOptions& options, const KnownRuns& known);

/// Checks that --output is not an input of the command: the records, station.yaml, or a file named
/// in it.
void check_output_option(const StationRecordsOptions& options, const KnownRuns& known);

}  // namespace vlp
