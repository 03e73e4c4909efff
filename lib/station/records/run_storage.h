// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <optional>
#include <string>

#include "station/records/run_record.h"

namespace vlp {

/// Loads the texts of a run (run_fields()) from tables of the current version; std::nullopt if no
/// run has this id. All functions of this header throw soci::soci_error.
std::optional<RunRecord> load_run_header(soci::session& sql, const std::string& run);
/// Loads a run with its metrics, images and events, with the names of metrics as they were stored;
/// std::nullopt if no run has this id.
std::optional<RunRecord> load_run(soci::session& sql, const std::string& run);

}  // namespace vlp
