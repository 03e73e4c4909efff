// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Run and make_records_database_id() of the records that it belongs to.
struct SpooledRun {
  RunRecord run;
  std::string records;
};

/// Serializes a run as `vlp-run/1`: a JSON object with "records", the texts of run_fields(),
/// "figures", "images" and "events". Figures with a guard band have "uncertainty" and "guard_k".
/// Invalid text is written as by printable().
std::string serialize_run(const SpooledRun& spooled);
/// Reads a run in the format of serialize_run(). A missing text of run_fields() is empty, as in
/// files of older programs. Throws InputError with the file, also if it contains no run.
SpooledRun read_run(const std::filesystem::path& file);

/// Returns a run as a JSON object for the hook: "event" ("verdict", or "voided" for a voided run),
/// then the members written by write_runs().
std::string format_hook_json(const RunRecord& run);

/// Writes runs atomically, in the format of the file's extension. Throws InputError, also for
/// another extension.
///
///   .csv   one row per run: run, kind, station, camera, operator_name, shift, begun_utc,
///   ended_utc,
///          verdict, causes, program, config_sha256, and a column per metric, empty if missing
///   .json  list of objects: the texts of run_fields(), images, events, and each metric with value,
///          unit, gate and result of the gate
void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs);

}  // namespace vlp
