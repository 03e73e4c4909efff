// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "report/report_picture.h"
#include "station/records.h"

namespace vlp {

/// Keeps the record, then writes RESULTS/CAMERA/RUN/: calibration.yaml when the unit passed,
/// failed-calibration.yaml when it failed and came so far; report.html, last. Throws InputError.
void finish_run(const RunRecord& record, const std::vector<ReportPicture>& pictures,
                Records& records, const std::filesystem::path& results);

/// The second half of it, which can be done at any time. What is there stays: a report has pictures
/// that the record has not. The folder that it went to.
std::filesystem::path publish_run(const RunRecord& record,
                                  const std::vector<ReportPicture>& pictures,
                                  const std::filesystem::path& results);

}  // namespace vlp
