// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "station/run_record.h"

namespace vlp {

/// The page for people that tells of a run (report.html): verdict, gates, causes, figures, the
/// calibration with its history. It rests on the record alone. `calibration`: the file with the
/// record's calibration; empty when there is none. Throws InputError.
std::string unit_report(const RunRecord& record, const std::filesystem::path& calibration);

}  // namespace vlp
