// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/records/spool.h"
#include "station/station_config.h"

namespace vlp {

/// Result of void_recorded_run().
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
/// At the station of the run its files are renamed (rename_voided_files()), and its hook is
/// called (run_and_record_hook()). These steps are completed there for a run that was voided
/// before with records alone.
///
/// @param runs     spool of the station, or records alone
/// @param station  the station; null for records alone
///
/// Throws std::invalid_argument if the operator is not among StationConfig::void_operators of that
/// station. Throws it, too, if the run was voided before and no step is missing. Throws InputError
/// if the event cannot be recorded or the hook is running.
VoidedRun void_recorded_run(Spool& runs, const StationConfig* station, const std::string& run,
                            const std::string& operator_name, const std::string& reason);

}  // namespace vlp
