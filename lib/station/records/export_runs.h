// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

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
