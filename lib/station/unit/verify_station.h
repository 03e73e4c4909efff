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

/// What verify_station() has found, with the pictures of the boards and of the dispersion.
struct Verified {
  RunRecord record;
  std::vector<ReportPicture> pictures;
};

/// Measures the station with its golden unit, a camera whose calibration is known: FOLDER/check/
/// and, where they are there, FOLDER/dispersion/ and FOLDER/boards/. The lens that the boards give
/// is compared with the known one (center_px, focal_percent, nominal_px): when it differs, the
/// board has. The fixes are made with the known calibration: when they are off, lamps or known
/// points have moved. Here FAIL is of the station, and INVALID a golden unit that was not measured.
/// `run` is of new_run(), from before the measurement. Throws InputError without
/// images. Precondition: the configuration has a golden unit.
Verified verify_station(const StationConfig& config, const std::filesystem::path& folder,
                        const std::string& run, const ProgramVersion& program, int threads);

/// INVALID, as the first cause says, when an image that the record uses was used before: it says
/// nothing of the station now. `golden_run_of`: the earlier run that used an image of this digest;
/// empty when there is none.
void refuse_used_images(RunRecord& record,
                        const std::function<std::string(const std::string& sha256)>& golden_run_of);

}  // namespace vlp
