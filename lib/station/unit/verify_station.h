// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "report/report_picture.h"
#include "station/records/run_record.h"
#include "station/station_config.h"

namespace vlp {

/// Result of verify_from_images(), with the plots of boards and dispersion.
struct VerificationResult {
  RunRecord record;
  std::vector<ReportPlot> pictures;
};

/// Verifies the station with its golden unit, a camera of known calibration, and returns record and
/// plots. Images are read from FOLDER/check/ and, if they exist, FOLDER/dispersion/ and
/// FOLDER/boards/.
///
/// @param folder   FOLDER
/// @param run      id of the run, from make_run_id() before the measurement
/// @param threads  maximum number of threads
/// @throws InputError without images
/// @pre the configuration has a golden unit
///
/// The lens that the boards give is compared with the known one (principal_point_px, focal_percent,
/// nominal_difference_px). A difference shows that the board has changed. Fixes use the known
/// calibration; their errors show that lamps or known points have moved. FAIL here refers to the
/// station, and INVALID means that the golden unit was not measured.
VerificationResult verify_from_images(const StationConfig& config,
                                      const std::filesystem::path& folder, const std::string& run,
                                      const ProgramVersion& program, int threads);

/// Makes the record INVALID if an earlier run used one of its images, because the image does not
/// show the current state of the station. `find_golden_user` returns the earlier run that used an
/// image of this digest.
void invalidate_if_reused(
    RunRecord& record,
    const std::function<std::optional<std::string>(const std::string& sha256)>& find_golden_user);

}  // namespace vlp
