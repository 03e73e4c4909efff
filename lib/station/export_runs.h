// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "station/run_record.h"

namespace vlp {

/// Writes runs, whole or not at all. To .csv: a line for each with run, kind, station, camera,
/// begun_utc, ended_utc, verdict, causes, program, config_sha256 and each figure, empty where there
/// is none. To .json: all that is known of each, calibration and images too. Throws InputError, for
/// another ending, too.
void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs);

}  // namespace vlp
