// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/report_picture.h"
#include "station/records/run_record.h"

namespace vlp {

/// The page for people that tells of a run (report.html): verdict and causes, gates, other figures,
/// the calibration with its history, the pictures of its steps, the images that were refused.
/// `calibration`: the file with the record's calibration; empty when there is none. Throws
/// InputError.
std::string unit_report(const RunRecord& record, const std::filesystem::path& calibration,
                        const std::vector<ReportPicture>& pictures);

}  // namespace vlp
