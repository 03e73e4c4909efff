// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/report_picture.h"
#include "station/records/run_record.h"

namespace vlp {

/// That the results of a camera's run can be written, before it is begun: the folder is there,
/// takes a file, and has room. Throws InputError.
void check_results(const std::filesystem::path& results, const std::string& camera);

/// The name of a run's calibration among its files, by its verdict.
const char* calibration_name(const RunRecord& record);

/// Writes of RESULTS/CAMERA/RUN/ what is not there: calibration.yaml when the unit passed,
/// failed-calibration.yaml or invalid-calibration.yaml when it did not and came so far;
/// report.html, last, which without `pictures` has none. The folder. It can be done at any time,
/// and again. Throws InputError, for a calibration that is there and is another, too.
std::filesystem::path publish_run(const RunRecord& record,
                                  const std::vector<ReportPicture>& pictures,
                                  const std::filesystem::path& results);

}  // namespace vlp
