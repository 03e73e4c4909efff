// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Returns a run as a JSON object for the hook: "event", which is "verdict", or "voided" if the run
/// was voided; then the run as write_runs() has it.
std::string hook_json(const RunRecord& run);

/// Writes runs, whole or not at all. To .csv: a line for each with run, kind, station, camera,
/// operator_name, shift, begun_utc, ended_utc, verdict, causes, program, config_sha256 and each
/// figure, empty where there is none. To .json: a list of
/// objects with the texts of run_fields(), each figure with value, unit, gate and whether it is
/// met, images, events. Throws InputError, for another ending, too.
void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs);

}  // namespace vlp
