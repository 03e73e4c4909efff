// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/report_picture.h"
#include "station/records/run_record.h"

namespace vlp {

/// Returns the report of a run (report.html): verdict and causes, gates, other metrics, the
/// calibration with its history, the plots of its steps, and the rejected images. `calibration` is
/// the file with the record's calibration; empty if there is none. Throws InputError.
std::string make_unit_report(const RunRecord& record, const std::filesystem::path& calibration,
                             const std::vector<ReportPlot>& pictures);

}  // namespace vlp
