// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <optional>
#include <string>

#include "station/records/run_record.h"

namespace vlp {

/// The texts of a run (run_fields()) from the tables of the present version; nothing when it is
/// not kept. All here throw soci::soci_error.
std::optional<RunRecord> texts_of_run(soci::session& sql, const std::string& run);
/// All of a run; nothing when it is not kept.
std::optional<RunRecord> rows_of_run(soci::session& sql, const std::string& run);

}  // namespace vlp
